//! Torque capacity of a drive with its carrier's fingers (docs/explanation/theory.md section 4.7).

use crate::SolveError;
use crate::contact::PerContact;
use crate::fingers::{CarrierFingers, Safety, Strength};
use crate::load_sharing::LoadCase;
use crate::root::NotConverged;
use crate::sweep::{LimitedBy, TorqueCapacity};

/// Share of the torque to which a capacity that depends on itself is found.
const PRECISION: f64 = 1e-12;

/// Width of the bracket, as a share of the torque, at which the search ends: a sweep to a tolerance may jump within it.
/// The result is the capacity at the upper end, the smaller one.
const NARROW: f64 = 1e-9;

/// Limit of sweeps for such a capacity. Two suffice if contacts limit it, four if loads are proportional to the torque.
const MAX_SWEEPS: u32 = 60;

/// Force above zero that stands for none, as a share of the force that the finger bears without torque.
const NEARLY_NOTHING: f64 = 1e-9;

impl CarrierFingers {
    /// Runs a sweep whose torque capacity respects the fingers and the uneven load along them. `capacity` is the place of
    /// the capacity in the sweep's result.
    ///
    /// The slot's stress grows with the force on the finger. So the force that a finger bears is an allowable stress of
    /// the slot's contact.
    ///
    /// # Errors
    /// The errors of the sweep.
    pub fn limited<S>(
        &self,
        load: &LoadCase,
        run: impl Fn(&LoadCase) -> Result<S, SolveError>,
        capacity: fn(&mut S) -> &mut Option<TorqueCapacity>,
    ) -> Result<S, SolveError> {
        let Some(allowable_mpa) = load.parameters().allowable_stress_mpa else { return run(load) };
        let even_mpa = PerContact::of(|contact| allowable_mpa.get(contact) / self.stress_factor(contact));
        let under = |output_torque_nm: f64| {
            let slot_mpa = self.slot_limit_mpa(output_torque_nm);
            let carrier = even_mpa.carrier.min(slot_mpa);
            let mut swept = run(&load.with_allowable_stress(PerContact { carrier, ..even_mpa }))?;
            let mut torque_nm = 0.0;
            if let Some(capacity) = capacity(&mut swept) {
                torque_nm = capacity.output_torque_nm;
                if capacity.limited_by == LimitedBy::Carrier && slot_mpa < even_mpa.carrier {
                    capacity.limited_by = self.finger_limit();
                }
            }
            Ok::<_, SolveError>((swept, torque_nm))
        };
        let (swept, most_nm) = under(0.0)?;
        if !self.limits_fall_with_torque() {
            return Ok(swept);
        }
        // With the torque the moment that is left for the tooth's force becomes less: the capacity is the torque under
        // which it is the torque itself.
        let mut bracket = Bracket::below(most_nm);
        let mut torque_nm = most_nm;
        for _ in 0..MAX_SWEEPS {
            let (swept, found_nm) = under(torque_nm)?;
            if (torque_nm - found_nm).abs() <= PRECISION * torque_nm {
                return Ok(swept);
            }
            torque_nm = bracket.next(torque_nm, found_nm);
            if bracket.high_nm - bracket.low_nm <= NARROW * bracket.high_nm {
                return Ok(under(bracket.high_nm)?.0);
            }
        }
        Err(NotConverged {
            what: "torque capacity of the fingers",
            iterations: MAX_SWEEPS,
            bracket_width: bracket.high_nm - bracket.low_nm,
        }
        .into())
    }

    /// Returns true if the force that a finger bears falls with the torque, so that a capacity takes several sweeps.
    pub fn limits_fall_with_torque(&self) -> bool {
        self.moment_nmm_per_nm > 0.0 && self.parameters.strength.is_some()
    }

    /// Returns the stress of the slot's contact under the largest force that a finger bears together with the torque.
    fn slot_limit_mpa(&self, output_torque_nm: f64) -> f64 {
        let Some(strength) = self.parameters.strength else { return f64::INFINITY };
        let moment_nmm = self.safety_at_1_mpa(&strength).least() / self.nominal_mpa_per_nmm();
        let left_nmm = moment_nmm - self.moment_nmm_per_nm * output_torque_nm;
        self.slot.stress_mpa(left_nmm.max(NEARLY_NOTHING * moment_nmm) / self.moment_nmm_per_n)
    }

    /// Returns the safety under a nominal stress of 1 MPa: the nominal stresses at which a finger yields and at which it
    /// breaks by fatigue.
    fn safety_at_1_mpa(&self, strength: &Strength) -> Safety {
        strength.safety(self.parameters.cycle, 1.0, self.concentration())
    }

    fn finger_limit(&self) -> LimitedBy {
        let is_fatigue = self.parameters.strength.is_some_and(|strength| {
            let Safety { yielding, fatigue } = self.safety_at_1_mpa(&strength);
            fatigue < yielding
        });
        if is_fatigue { LimitedBy::FingerFatigue } else { LimitedBy::FingerYield }
    }
}

/// Bracket of the torque under which the capacity is the torque itself: regula falsi by the Illinois rule.
struct Bracket {
    low_nm: f64,
    high_nm: f64,
    /// Torque less capacity at both ends: zero or negative, then positive. NaN at an end not seen yet.
    below_nm: f64,
    above_nm: f64,
    was_above: bool,
}

impl Bracket {
    const fn below(high_nm: f64) -> Self {
        Self { low_nm: 0.0, high_nm, below_nm: f64::NAN, above_nm: f64::NAN, was_above: false }
    }

    /// Takes the capacity under a torque and returns the next torque.
    fn next(&mut self, torque_nm: f64, found_nm: f64) -> f64 {
        let is_above = torque_nm > found_nm;
        let is_again = is_above == self.was_above;
        self.was_above = is_above;
        if is_above {
            (self.high_nm, self.above_nm) = (torque_nm, torque_nm - found_nm);
            if is_again {
                self.below_nm *= 0.5;
            }
        } else {
            (self.low_nm, self.below_nm) = (torque_nm, torque_nm - found_nm);
            if is_again {
                self.above_nm *= 0.5;
            }
        }
        // The capacity falls with the torque, so the one under a larger torque is below the root.
        if self.below_nm.is_nan() {
            return found_nm;
        }
        self.high_nm - self.above_nm * (self.high_nm - self.low_nm) / (self.above_nm - self.below_nm)
    }
}
