//! Strength of a material, and safety under a load that comes and goes (docs/explanation/theory.md section 4.12).

/// Strength of a material, in MPa.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(deny_unknown_fields, expecting = "an object"), schema(as = StrengthNumbersDocument))]
pub struct Strength {
    /// Yield strength R_p0.2, in MPa.
    #[cfg_attr(feature = "document", serde(rename = "yield_strength_mpa"))]
    pub yield_mpa: f64,
    /// Tensile strength R_m, in MPa.
    #[cfg_attr(feature = "document", serde(rename = "tensile_strength_mpa"))]
    pub tensile_mpa: f64,
    /// Endurance limit σ_W under reversed load, without a notch, in MPa.
    #[cfg_attr(feature = "document", serde(rename = "endurance_limit_mpa"))]
    pub endurance_mpa: f64,
    /// True if the material breaks at a notch before it yields there, as hardened steel does. Default: false.
    #[cfg_attr(feature = "document", serde(rename = "hardened", default), schema(default = false))]
    pub is_hardened: bool,
}

/// Course of the load on a finger.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(rename_all = "snake_case"))]
pub enum LoadCycle {
    /// From zero to its maximum: the torque keeps its sense.
    #[default]
    Pulsating,
    /// From one maximum to the opposite one: the torque changes its sense.
    Reversed,
}

/// Safety of a finger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Safety {
    /// Against yield, or against breaking if the material is hardened.
    pub yielding: f64,
    /// Against fatigue.
    pub fatigue: f64,
}

impl Safety {
    /// Returns the lesser of both.
    pub const fn least(&self) -> f64 {
        self.yielding.min(self.fatigue)
    }
}

impl Strength {
    /// Returns the largest stress at the notch that is endured without end: `1/S_D = σ_a/σ_W + σ_m/R_m`.
    pub fn endured_mpa(&self, cycle: LoadCycle) -> f64 {
        match cycle {
            LoadCycle::Pulsating => 2.0 / (1.0 / self.endurance_mpa + 1.0 / self.tensile_mpa),
            LoadCycle::Reversed => self.endurance_mpa,
        }
    }

    /// Returns the safety under a nominal stress and its stress concentration.
    pub fn safety(&self, cycle: LoadCycle, nominal_mpa: f64, concentration: f64) -> Safety {
        let largest_mpa = concentration * nominal_mpa;
        let counted_mpa = if self.is_hardened { largest_mpa } else { nominal_mpa };
        Safety { yielding: self.yield_mpa / counted_mpa, fatigue: self.endured_mpa(cycle) / largest_mpa }
    }
}

/// Stress concentration of a bar with square shoulders in bending, by its fillet's radius over its thickness: W. C.
/// Young, R. G. Budynas, *Roark's Formulas for Stress and Strain*, table 17.1, for a step of 20 radii.
const SHOULDER: [(f64, f64); 4] = [(0.05, 2.39), (0.1, 1.91), (0.15, 1.68), (0.2, 1.54)];

/// Returns that stress concentration: powers of the radius between the table's places and below them. Above them it is
/// that of the largest radius, since the table says nothing of larger ones.
pub fn stress_concentration(fillet_over_thickness: f64) -> f64 {
    let fillet_over_thickness = fillet_over_thickness.min(SHOULDER[3].0);
    let at = SHOULDER[1..3].iter().filter(|(radius, _)| *radius < fillet_over_thickness).count();
    let [(radius, factor), (next_radius, next_factor)] = [SHOULDER[at], SHOULDER[at + 1]];
    let power = (next_factor / factor).ln() / (next_radius / radius).ln();
    factor * (fillet_over_thickness / radius).powf(power)
}
