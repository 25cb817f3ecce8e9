//! Materials that designers know by name, each number with its published source. What has none is left out.

use serde::Serialize;
use toothwave_solver::findings::FATIGUE_LIMIT_STRESS_MPA;
use utoipa::ToSchema;

/// A material, as a document's `materials` spell its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct MaterialPreset {
    /// Name.
    pub name: &'static str,
    /// Description.
    pub title: &'static str,
    /// Young's modulus E.
    pub youngs_modulus_gpa: f64,
    /// Poisson's ratio ν.
    pub poissons_ratio: f64,
    /// Source of modulus and ratio.
    pub elasticity_source: &'static str,
    /// The contact stress that it may have, for `load.allowable_stress_mpa`: under rolling with lubrication, without a factor of safety; left out
    /// where none is published as a Hertz stress.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowable_stress_mpa: Option<f64>,
    /// Source.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowable_stress_source: Option<&'static str>,
}

const GEAR_STEEL: &str = "ISO 6336-2:2019, steel: E = 206 000 N/mm², ν = 0.3";

/// All of them.
pub const MATERIALS: [MaterialPreset; 6] = [
    MaterialPreset {
        name: "bearing-steel",
        title: "Bearing steel, through-hardened",
        youngs_modulus_gpa: 207.0,
        poissons_ratio: 0.3,
        elasticity_source: "ISO/TR 1281-1:2008, explanatory notes on ISO 281: E = 207 000 MPa, ν = 0.3",
        allowable_stress_mpa: Some(FATIGUE_LIMIT_STRESS_MPA),
        allowable_stress_source: Some(
            "ISO 281:2007, contact stress at the fatigue load limit of common high-quality bearing steel; Zaretsky, Tribology & Lubrication Technology 66(8), 2010: von Mises stress 900 MPa, Hertz stress 1500 MPa",
        ),
    },
    MaterialPreset {
        name: "case-hardened-steel",
        title: "Case-hardened wrought steel",
        youngs_modulus_gpa: 206.0,
        poissons_ratio: 0.3,
        elasticity_source: GEAR_STEEL,
        allowable_stress_mpa: Some(1500.0),
        allowable_stress_source: Some("ISO 6336-5:2016, σ_H lim of case-hardened wrought steel, quality MQ"),
    },
    MaterialPreset {
        name: "quenched-and-tempered-steel",
        title: "Quenched and tempered alloy steel of 300 HV",
        youngs_modulus_gpa: 206.0,
        poissons_ratio: 0.3,
        elasticity_source: GEAR_STEEL,
        // 1.313 HV + 373
        allowable_stress_mpa: Some(766.9),
        allowable_stress_source: Some(
            "ISO 6336-5:2016, σ_H lim = 1.313 HV + 373 of through-hardened wrought alloy steel, quality MQ",
        ),
    },
    MaterialPreset {
        name: "bronze",
        title: "Bearing bronze UNS C93200 (SAE 660)",
        youngs_modulus_gpa: 100.0,
        poissons_ratio: 0.34,
        elasticity_source: "AZoM, Bearing Bronze (UNS C93200), article 6294: E = 100 GPa, ν = 0.34",
        allowable_stress_mpa: None,
        allowable_stress_source: None,
    },
    MaterialPreset {
        name: "pom",
        title: "POM, acetal homopolymer",
        youngs_modulus_gpa: 3.0,
        poissons_ratio: 0.35,
        elasticity_source: "Margolis, Engineering Plastics Handbook, McGraw-Hill 2006, table 5.5: tensile modulus 3.0 GPa; ν by DuPont, Delrin Design Guide, Module III",
        allowable_stress_mpa: None,
        allowable_stress_source: None,
    },
    MaterialPreset {
        name: "pla",
        title: "PLA, injection moulded; printed parts have less, by direction and filling",
        youngs_modulus_gpa: 3.5,
        poissons_ratio: 0.36,
        elasticity_source: "Farah, Anderson, Langer, Advanced Drug Delivery Reviews 107, 2016, 367-392: E = 3.5 GPa, ν = 0.36",
        allowable_stress_mpa: None,
        allowable_stress_source: None,
    },
];
