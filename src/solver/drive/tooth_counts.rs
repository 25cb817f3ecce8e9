//! Tooth numbers that do not fit each other, and the nearest ones that do.

use crate::violation::{FieldCode, Parameter, Violation};

/// Returns a violation if carrier and ring do not differ by one tooth for each lobe, or the ring has fewer teeth than
/// lobes.
pub(super) fn tooth_difference(teeth: i64, ring_teeth: i64, lobes: i64) -> Option<Violation> {
    let is_possible = |ring: &i64| *ring >= lobes && Parameter::RingTeeth.check(*ring as f64).is_none();
    let possible = [teeth - lobes, teeth + lobes].into_iter().filter(is_possible).collect::<Vec<_>>();
    if possible.contains(&ring_teeth) {
        return None;
    }
    let difference = if lobes == 1 { "1 tooth".to_owned() } else { format!("{lobes} teeth") };
    let (nearest, instead) = nearest_to(ring_teeth, &possible);
    let detail = format!(
        "carrier and ring must differ by {difference}, one for each lobe of the wave generator: with {teeth} teeth the ring has {instead}, not {ring_teeth}"
    );
    Some(Violation::new(FieldCode::ToothDifference, Parameter::RingTeeth, ring_teeth as f64, nearest, detail))
}

/// Returns a violation if the number of installed teeth does not divide that of all teeth.
pub(super) fn installed_no_divisor(installed: i64, teeth: i64) -> Option<Violation> {
    if teeth % installed == 0 {
        return None;
    }
    let is_divisor = |other: &i64| teeth % other == 0;
    let below = (2..installed).rev().find(is_divisor);
    let possible = below.into_iter().chain((installed + 1..=teeth).find(is_divisor)).collect::<Vec<_>>();
    let (nearest, instead) = nearest_to(installed, &possible);
    let detail = format!(
        "{installed} installed teeth do not divide {teeth}: teeth are removed evenly, every m-th slot keeps its tooth; choose {instead}"
    );
    let (code, parameter) = (FieldCode::InstalledNoDivisor, Parameter::InstalledTeeth);
    Some(Violation::new(code, parameter, installed as f64, nearest, detail))
}

/// Returns the nearest of the possible numbers, the lower one if two are equally near, and the text of all. There is
/// always one.
fn nearest_to(count: i64, possible: &[i64]) -> (f64, String) {
    let nearest = possible.iter().min_by_key(|other| (*other - count).abs()).unwrap_or(&count);
    let texts: Vec<_> = possible.iter().map(i64::to_string).collect();
    (*nearest as f64, texts.join(" or "))
}
