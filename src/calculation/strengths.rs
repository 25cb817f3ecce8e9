//! Strengths of carrier materials by name, each number with its source. Rules are named as such.

use serde::Serialize;
use utoipa::ToSchema;

/// Strength of a material, as `parts.carrier.strength` spells its numbers: typical values at room temperature, without
/// a factor of safety.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct StrengthPreset {
    /// Name.
    pub name: &'static str,
    /// Description.
    pub title: &'static str,
    /// Yield strength R_p0.2.
    pub yield_strength_mpa: f64,
    /// Tensile strength R_m.
    pub tensile_strength_mpa: f64,
    /// Source of both.
    pub strength_source: &'static str,
    /// Endurance limit σ_W under reversed load, without a notch.
    pub endurance_limit_mpa: f64,
    /// Source or rule.
    pub endurance_source: &'static str,
    /// True if the material breaks at a notch before it yields there.
    pub hardened: bool,
}

const HEAT_TREATED_ALLOY: &str = "EN 10083-3:2006; Saarstahl, material sheet 42CrMo4";
const HEAT_TREATED_CARBON: &str = "EN 10083-2; Saarstahl, material sheet C45";
const SHARE_OF_TENSILE: &str = "rule: 0.45 R_m";

const fn steel(
    name: &'static str,
    title: &'static str,
    [yield_strength_mpa, tensile_strength_mpa, endurance_limit_mpa]: [f64; 3],
    strength_source: &'static str,
) -> StrengthPreset {
    StrengthPreset {
        name,
        title,
        yield_strength_mpa,
        tensile_strength_mpa,
        strength_source,
        endurance_limit_mpa,
        endurance_source: SHARE_OF_TENSILE,
        hardened: false,
    }
}

/// All of them.
pub const STRENGTHS: [StrengthPreset; 7] = [
    steel("42crmo4-qt", "42CrMo4 +QT, bar up to 16 mm in diameter", [900.0, 1100.0, 495.0], HEAT_TREATED_ALLOY),
    steel("42crmo4-qt-40", "42CrMo4 +QT, bar of 16 to 40 mm", [750.0, 1000.0, 450.0], HEAT_TREATED_ALLOY),
    steel("42crmo4-qt-100", "42CrMo4 +QT, bar of 40 to 100 mm", [650.0, 900.0, 405.0], HEAT_TREATED_ALLOY),
    steel("c45-qt", "C45 +QT, bar up to 16 mm in diameter", [490.0, 700.0, 315.0], HEAT_TREATED_CARBON),
    steel("c45-n", "C45 +N, bar up to 16 mm in diameter", [340.0, 620.0, 279.0], HEAT_TREATED_CARBON),
    StrengthPreset {
        name: "100cr6",
        title: "100Cr6, hardened, tempered at 200 °C",
        yield_strength_mpa: 2080.0,
        tensile_strength_mpa: 2500.0,
        strength_source: "Lucefin, technical card 102Cr6 (100Cr6), EN ISO 4957, 10 mm round",
        endurance_limit_mpa: 700.0,
        endurance_source: "rule: Shigley's Mechanical Engineering Design, 700 MPa for steel above R_m = 1400 MPa",
        hardened: true,
    },
    StrengthPreset {
        name: "en-aw-7075-t6",
        title: "Aluminium EN AW-7075-T6",
        yield_strength_mpa: 503.0,
        tensile_strength_mpa: 572.0,
        strength_source: "SubsTech, wrought aluminium alloy 7075 (T6, T651); typical, not minimum",
        endurance_limit_mpa: 159.0,
        endurance_source: "SubsTech; at 5e8 cycles, since aluminium has no endurance limit",
        hardened: false,
    },
];
