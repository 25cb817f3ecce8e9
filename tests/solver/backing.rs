//! Compliance of the supports, against finite elements of the same bodies (`tests/finite_elements/backing.py`)
//! and against the model itself.

use std::f64::consts::PI;

use serde::Deserialize;
use toothwave_solver::Compatibility::VirtualWork;
use toothwave_solver::backing::{Backing, Backings, Estimate, HeldStrip, Rim, RimStrip, Support};
use toothwave_solver::drive::Draft;
use toothwave_solver::findings;
use toothwave_solver::fingers::{FOOT_IN_DISC, FingerBeam, Fingers};
use toothwave_solver::model_error::{self, Beyond, Held, HeldCase, ModelError};
use toothwave_solver::parts::{CarrierRadii, PartsParameters};
use toothwave_solver::{
    Contact, ContactLaw, Deviations, DriveParameters, Finding, FindingCode, LoadCase, LoadParameters, Material,
    Materials, PerContact, Severity, ToothShape,
};

use crate::drives::{PAPER_5_1, PAPER_5_2, drive, load, swept};

#[derive(Deserialize)]
struct Results {
    fingers: Vec<Finger>,
    free_rims: Vec<FreeRim>,
    held_bodies: Vec<HeldBody>,
}

#[derive(Deserialize)]
struct Finger {
    length_mm: f64,
    thickness_mm: f64,
    height_mm: f64,
    at_both_ends: bool,
    compliance_mm_per_n: f64,
}

#[derive(Deserialize)]
struct FreeRim {
    inner_radius_mm: f64,
    outer_radius_mm: f64,
    width_mm: f64,
    teeth: i64,
    lobes: u32,
    compliance_mm_per_n: f64,
}

#[derive(Deserialize)]
struct HeldBody {
    surface_radius_mm: f64,
    held_radius_mm: f64,
    tooth_radius_mm: f64,
    width_mm: f64,
    teeth: i64,
    compliance_mm_per_n: f64,
}

fn results() -> Results {
    serde_json::from_str(include_str!("../finite_elements/backing.json")).unwrap()
}

const JOHNSON: ContactLaw = ContactLaw::JOHNSON;

fn johnson(torque_nm: f64) -> LoadParameters {
    LoadParameters { law: JOHNSON, ..load(torque_nm, VirtualWork) }
}

fn backings(parameters: &DriveParameters, parts: &PartsParameters, support: Support) -> Backings {
    Backings::of(&drive(parameters), &Draft::new(parameters).unwrap(), parts, support)
}

/// Estimates the compliances of a loaded drive and their shares.
fn shares(parameters: &DriveParameters, load: &LoadParameters, support: Support) -> Option<Vec<Estimate>> {
    let sweep = swept(parameters, load, 50);
    let backings = backings(parameters, &PartsParameters::default(), support);
    backings.estimates_with_shares(&drive(parameters), load, &sweep.peaks)
}

fn estimate(estimates: &[Estimate], wanted: Backing) -> &Estimate {
    estimates.iter().find(|estimate| estimate.backing == wanted).unwrap()
}

fn share(estimates: &[Estimate], wanted: Backing) -> f64 {
    estimate(estimates, wanted).share.unwrap()
}

const AT_ONE_END: Support = Support { fingers: Fingers::HeldAtOneEnd, rim: Rim::Housed };
const AT_BOTH_ENDS: Support = Support { fingers: Fingers::HeldAtBothEnds, rim: Rim::Housed };
const FREE: Support = Support { fingers: Fingers::HeldAtBothEnds, rim: Rim::Free };

#[test]
fn finger_compliance_matches_finite_elements() {
    for finger in results().fingers {
        let Finger { length_mm, thickness_mm, height_mm, at_both_ends, compliance_mm_per_n } = finger;
        let held = if at_both_ends { Fingers::HeldAtBothEnds } else { Fingers::HeldAtOneEnd };
        // Held in rigid discs, and pressed square to their sides.
        let beam = FingerBeam { length_mm, thickness_mm, height_mm, count: i64::MAX, foot: 0.0 };
        let found = beam.compliance_mm_per_n(&Material::STEEL, held);
        assert!(
            (found / compliance_mm_per_n - 1.0).abs() < if at_both_ends { 0.05 } else { 0.01 },
            "{length_mm} x {thickness_mm}, {held:?}: {found:e}, by finite elements {compliance_mm_per_n:e}"
        );
    }
}

#[test]
fn free_rim_compliance_matches_finite_elements() {
    for rim in results().free_rims {
        let FreeRim { inner_radius_mm, outer_radius_mm, width_mm, teeth, lobes, compliance_mm_per_n } = rim;
        let found = RimStrip { inner_radius_mm, outer_radius_mm, width_mm, teeth, lobes }
            .free_compliance_mm_per_n(&Material::STEEL);
        assert!(
            (found / compliance_mm_per_n - 1.0).abs() < 0.015,
            "{inner_radius_mm} to {outer_radius_mm}, {lobes} lobes: {found:e}, by finite elements {compliance_mm_per_n:e}"
        );
    }
}

#[test]
fn held_rims_and_cams_match_finite_elements() {
    for body in results().held_bodies {
        let HeldBody { surface_radius_mm, held_radius_mm, tooth_radius_mm, width_mm, teeth, compliance_mm_per_n } =
            body;
        let strip = HeldStrip {
            depth_mm: (held_radius_mm - surface_radius_mm).abs(),
            pitch_mm: 2.0 * PI * surface_radius_mm / teeth as f64,
            width_mm,
        };
        let found = strip.compliance_mm_per_n(&Material::STEEL, tooth_radius_mm);
        // A rim is a strip. A deep cam narrows towards its bore, and its load is uneven.
        let is_rim = held_radius_mm > surface_radius_mm;
        let of_steel = 0.91 / (PI * 210e3 * width_mm);
        let allowed = if is_rim { 0.1 * of_steel } else { 0.3 * compliance_mm_per_n };
        assert!(
            (found - compliance_mm_per_n).abs() < allowed,
            "{surface_radius_mm} to {held_radius_mm}: {found:e}, by finite elements {compliance_mm_per_n:e}"
        );
    }
}

#[test]
fn held_body_compliance_is_continuous_in_depth() {
    let strip = |depth_mm| HeldStrip { depth_mm, pitch_mm: 8.0, width_mm: 15.0 };
    let at = |depth_mm| strip(depth_mm).compliance_mm_per_n(&Material::STEEL, 2.0);
    assert!((at(4.0 - 1e-9) / at(4.0 + 1e-9) - 1.0).abs() < 1e-8);
    // A body held nearer is stiffer, finally stiffer than the contact law already assumes.
    assert!(at(8.0) > at(4.0) && at(4.0) > at(2.0) && at(0.5) < 0.0);
}

#[test]
fn finger_thickness_is_wall_distance_at_mid_height() {
    let shares = shares(&PAPER_5_1, &johnson(20.0), AT_ONE_END).unwrap();
    let found = estimate(&shares, Backing::FingerAtOneEnd);
    // From 58.8 to 65.2 mm. The middles of two slots are 2 · 62 sin(π/28) apart.
    let beam = FingerBeam {
        length_mm: 15.0,
        thickness_mm: 124.0 * (PI / 28.0).sin() - 10.0,
        height_mm: 6.4,
        count: 28,
        foot: FOOT_IN_DISC,
    };
    let expected = beam.compliance_mm_per_n(&Material::STEEL, Fingers::HeldAtOneEnd);
    assert!((found.compliance_mm_per_n / expected - 1.0).abs() < 1e-12, "{} {expected}", found.compliance_mm_per_n);
}

#[test]
fn housed_rim_is_strip_with_slot_pitch() {
    let parts = PartsParameters { ring_outer_radius_mm: Some(88.0), ..PartsParameters::default() };
    let load = johnson(20.0);
    let backings = backings(&PAPER_5_1, &parts, AT_ONE_END);
    let case = LoadCase::new(&load).unwrap();
    let estimates = backings.estimates(&drive(&PAPER_5_1), case.parameters());
    let found = estimates.iter().find(|estimate| estimate.backing == Backing::HousedRim).unwrap();
    // Teeth press on the root circle of 68 mm. The rim is deeper than half their pitch.
    let strip = HeldStrip { depth_mm: 20.0, pitch_mm: 2.0 * PI * 68.0 / 28.0, width_mm: 15.0 };
    let expected = strip.compliance_mm_per_n(&Material::STEEL, 5.0);
    assert!((found.compliance_mm_per_n / expected - 1.0).abs() < 1e-12, "{} {expected}", found.compliance_mm_per_n);
}

/// The teeth's own approach follows Johnson's law, with each half from its body's own elasticity.
#[test]
fn backing_share_is_relative_to_own_contacts() {
    let bronze = Material { youngs_modulus_gpa: 110.0, poissons_ratio: 0.35 };
    let steel = Material::STEEL;
    let materials = Materials { wave_generator: steel, teeth: steel, ring: bronze, carrier: bronze };
    let load = LoadParameters { materials, ..johnson(20.0) };
    let peaks = swept(&PAPER_5_1, &load, 50).peaks;
    let per_width = |body: &Material| (1.0 - body.poissons_ratio.powi(2)) / (1e3 * body.youngs_modulus_gpa * PI * 15.0);
    let squared_ratio = |contact| (peaks.get(contact).force_n.value / peaks.wave_generator.force_n.value).powi(2);
    let own = PerContact::of(|contact| {
        let half_mm = peaks.get(contact).half_width_mm;
        let partner = if contact == Contact::WaveGenerator { &steel } else { &bronze };
        let nu = partner.poissons_ratio;
        squared_ratio(contact)
            * (per_width(&materials.teeth) * (2.0 * (20.0 / half_mm).ln() - 1.0)
                + per_width(partner) * (2.0 * (10.0 / half_mm).ln() - nu / (1.0 - nu)))
    });
    let shares = shares(&PAPER_5_1, &load, AT_ONE_END).unwrap();
    let finger = estimate(&shares, Backing::FingerAtOneEnd);
    let share = finger.share.unwrap();
    let expected =
        squared_ratio(Contact::Carrier) * finger.compliance_mm_per_n / (own.wave_generator + own.ring + own.carrier);
    assert!((share / expected - 1.0).abs() < 1e-12, "{share}, expected {expected}");
}

/// The estimate for one tooth holds for the drive, except for load that shifts to other teeth.
#[test]
fn fingers_held_at_one_end_soften_drive() {
    let plain = johnson(20.0);
    let of_fingers = shares(&PAPER_5_1, &plain, AT_ONE_END).unwrap();
    let finger = estimate(&of_fingers, Backing::FingerAtOneEnd);
    let series = PerContact { carrier: finger.compliance_mm_per_n, ..PerContact::default() };
    let given = LoadParameters { series_compliance_mm_per_n: series, ..plain };
    let (before, after) = (swept(&PAPER_5_1, &plain, 50), swept(&PAPER_5_1, &given, 50));
    let wind_up = after.input_angles.wind_up_deg[0] / before.input_angles.wind_up_deg[0];
    let peak = after.peaks.wave_generator.force_n.value / before.peaks.wave_generator.force_n.value;
    assert!((2.15..2.3).contains(&wind_up) && (0.86..0.9).contains(&peak), "{wind_up}, {peak}");
    let share = finger.share.unwrap();
    assert!((1.0..1.2).contains(&((1.0 + share) / wind_up)), "share {share}");
    // A given compliance no longer counts as left out.
    let left = shares(&PAPER_5_1, &given, AT_ONE_END).unwrap();
    assert_eq!(estimate(&left, Backing::FingerAtOneEnd).share, None);
}

#[test]
fn only_soft_parts_are_findings() {
    let found = |parameters: &DriveParameters, load: &LoadParameters, support| {
        shares(parameters, load, support).map(|shares| findings::of_backing(&shares))
    };
    assert_eq!(found(&PAPER_5_1, &johnson(20.0), AT_BOTH_ENDS), Some(Vec::new()));
    let joined = found(&PAPER_5_1, &johnson(20.0), Support::default()).unwrap();
    let one_end = found(&PAPER_5_1, &johnson(20.0), AT_ONE_END).unwrap();
    let assert_finding = |found: &[Finding], wanted: (FindingCode, Severity), least: f64, most: f64| {
        let [Finding { code, severity, value, .. }] = *found else { panic!("{found:?}") };
        assert!((code, severity) == wanted && (least..most).contains(&value), "{found:?}");
    };
    assert_finding(&joined, (FindingCode::SlenderFingers, Severity::Info), 0.2, 0.5);
    assert_finding(&one_end, (FindingCode::SlenderFingers, Severity::Warning), 1.0, f64::INFINITY);
    let free = found(&PAPER_5_1, &johnson(20.0), FREE).unwrap();
    assert_finding(&free, (FindingCode::SoftRim, Severity::Warning), 10.0, f64::INFINITY);
    // Those of case 5.2 are a millimetre and a half high: slender however they are held.
    let low = found(&PAPER_5_2, &johnson(3.0), AT_BOTH_ENDS).unwrap();
    assert_finding(&low, (FindingCode::SlenderFingers, Severity::Info), 0.2, 1.0);
    // Under other laws wind-up is further off by itself.
    let fixed = ContactLaw::Fixed(PerContact { wave_generator: 4e5, ring: 4e5, carrier: 4e5 });
    for law in [fixed, ContactLaw::Linear, ContactLaw::Palmgren] {
        assert_eq!(found(&PAPER_5_1, &LoadParameters { law, ..johnson(20.0) }, AT_ONE_END), None);
    }
}

fn error_of_model(parameters: &DriveParameters, load: &LoadParameters, support: Support) -> ModelError {
    let sweep = swept(parameters, load, 50);
    let shares = shares(parameters, load, support);
    let case = LoadCase::new(load).unwrap();
    let backings = backings(parameters, &PartsParameters::default(), support);
    let parts = Some((&backings, shares.as_deref()));
    model_error::of(&drive(parameters), &case, &Deviations::default(), &sweep, parts).unwrap()
}

#[test]
fn model_error_reports_how_parts_are_held() {
    for (parameters, torque_nm, support, case, is_soft) in [
        (PAPER_5_1, 20.0, AT_BOTH_ENDS, HeldCase::Housed, false),
        (PAPER_5_1, 20.0, Support::default(), HeldCase::SlenderFingers, true),
        (PAPER_5_1, 20.0, AT_ONE_END, HeldCase::FingersAtOneEnd, true),
        (PAPER_5_1, 20.0, FREE, HeldCase::FreeRim, true),
        (PAPER_5_2, 3.0, Support::default(), HeldCase::SlenderFingers, true),
    ] {
        let error = error_of_model(&parameters, &johnson(torque_nm), support);
        let Some(Held { case: found, wind_up, estimated_wind_up }) = error.held else { panic!("{support:?}") };
        assert_eq!(found, case);
        assert_eq!(wind_up.is_none(), case == HeldCase::SlenderFingers);
        assert!(estimated_wind_up < 0.0 && estimated_wind_up > -1.0, "{estimated_wind_up}");
        assert_eq!(error.beyond.contains(&Beyond::SoftBacking), is_soft, "{support:?}");
    }
    let linear = LoadParameters { law: ContactLaw::Linear, ..johnson(20.0) };
    assert_eq!(error_of_model(&PAPER_5_1, &linear, FREE).held, None);
}

/// The load at the foot of a finger widens a contact under every law.
#[test]
fn uneven_load_widens_contacts_under_other_laws() {
    let linear = LoadParameters { law: ContactLaw::Linear, ..johnson(80.0) };
    for (support, is_beyond) in [(AT_BOTH_ENDS, false), (AT_ONE_END, true)] {
        let found = error_of_model(&PAPER_5_1, &linear, support).beyond.contains(&Beyond::HalfWidth);
        assert_eq!(found, is_beyond, "{support:?}");
    }
}

#[test]
fn errors_of_backings_add_like_series_springs() {
    let both = Support { fingers: Fingers::HeldAtOneEnd, rim: Rim::Free };
    let shares = shares(&PAPER_5_1, &johnson(20.0), both).unwrap();
    let sum = share(&shares, Backing::FreeRim) + share(&shares, Backing::FingerAtOneEnd);
    let held = error_of_model(&PAPER_5_1, &johnson(20.0), both).held.unwrap();
    assert!((1.0 / (1.0 + sum) - 1.0 - held.estimated_wind_up).abs() < 1e-12);
}

#[test]
fn only_makeable_parts_with_line_contact_have_estimates() {
    let of = |parameters: &DriveParameters, parts: PartsParameters| -> Vec<Backing> {
        let case = LoadCase::new(&johnson(20.0)).unwrap();
        let estimates =
            backings(parameters, &parts, Support::default()).estimates(&drive(parameters), case.parameters());
        assert!(estimates.iter().all(|Estimate { compliance_mm_per_n, .. }| *compliance_mm_per_n >= 0.0));
        estimates.into_iter().map(|estimate| estimate.backing).collect()
    };
    let fingers =
        [Backing::FingerAtBothEnds, Backing::FingerAtOneEnd, Backing::FingerJoinedAtFarEnd, Backing::FingerOnWeb];
    let rims = [Backing::HousedRim, Backing::FreeRim];
    let all = PartsParameters { bore_radius_mm: Some(20.0), ..PartsParameters::default() };
    assert_eq!(of(&PAPER_5_1, all), [&[Backing::CamOnBore][..], &rims, &fingers].concat());
    assert_eq!(of(&PAPER_5_1, PartsParameters::default()), [&rims[..], &fingers].concat());
    let without_rim = PartsParameters { ring_outer_radius_mm: Some(60.0), ..PartsParameters::default() };
    assert_eq!(of(&PAPER_5_1, without_rim), fingers);
    let without_walls = PartsParameters {
        carrier: CarrierRadii { inner_mm: Some(70.0), outer_mm: None },
        ..PartsParameters::default()
    };
    assert_eq!(of(&PAPER_5_1, without_walls), rims);
    let balls = DriveParameters { tooth: ToothShape::Ball { groove_radius_mm: PerContact::default() }, ..PAPER_5_1 };
    assert!(of(&balls, all).is_empty());
}
