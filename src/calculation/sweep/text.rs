//! A sweep as text.

use std::io::{self, Write};

use toothwave_solver::sweep::Extremes;

use crate::findings::write_findings;
use crate::json::word;
use crate::sweep::answer::SweepAnswer;
use crate::sweep::{backing, backlash, fingers, losses, model_error};

impl SweepAnswer {
    pub(super) fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        writeln!(writer, "coincidence degree                  {:.12}", self.coincidence_degree)?;
        writeln!(writer, "period of the input angle           {:.6} deg", self.period_deg)?;
        if let Some(sweep_period_deg) = self.sweep_period_deg {
            writeln!(writer, "input angle of the sweep            {sweep_period_deg:.6} deg")?;
        }
        let zones = if self.states.lobe.is_none() { "per zone" } else { "in all zones" };
        writeln!(writer, "teeth in mesh {zones:<22}{}", self.teeth_in_mesh_per_zone)?;
        writeln!(writer, "teeth that carry {zones:<19}{}", self.loaded_teeth_per_zone)?;
        writeln!(writer, "states                              {}", self.states.tooth.len())?;
        writeln!(writer, "torque balance residual             {:.1e}", self.checks.torque_balance_residual)?;
        writeln!(writer, "period closure residual             {:.1e}", self.checks.period_closure_residual)?;
        writeln!(writer, "\npeak                              value   input angle      position")?;
        for (contact, peaks) in self.peaks.iter() {
            let name = contact.to_string().replace('_', " ");
            for (quantity, unit, peak) in [("force", "N", &peaks.force_n), ("stress", "MPa", &peaks.stress_mpa)] {
                writeln!(
                    writer,
                    "{name:<14} {quantity:<6} {:>14.3} {unit:<3} {:>9.4} deg {:>9.4} deg",
                    peak.value, peak.input_angle_deg, peak.position_deg
                )?;
            }
        }
        if let Some(capacity) = &self.torque_capacity {
            let limit = if capacity.turns_past_teeth {
                "beyond it the wave generator turns past its teeth".to_owned()
            } else {
                format!("limited by {}", word(&capacity.limited_by).replace('_', " "))
            };
            writeln!(
                writer,
                "\ntorque capacity, input and output   {:.6} and {:.6} N·m, {limit} at {:.4} deg",
                capacity.input_torque_nm, capacity.output_torque_nm, capacity.input_angle_deg
            )?;
        }
        if let Some(stress) = &self.fingers {
            fingers::write_text(stress, writer)?;
        }
        if let Some(wind_up) = &self.wind_up {
            let Extremes { least, largest } = Extremes::of(&wind_up.wind_up_deg);
            writeln!(writer, "\nwind-up of the input                {least:.6} to {largest:.6} deg")?;
            if let Some(unloaded_deg) = &wind_up.unloaded_wind_up_deg {
                let Extremes { least, largest } = Extremes::of(unloaded_deg);
                writeln!(writer, "the same without load               {least:.6} to {largest:.6} deg")?;
            }
            let Extremes { least, largest } = Extremes::of(&wind_up.torsional_stiffness_nm_per_rad);
            writeln!(writer, "torsional stiffness at the output   {least:.6e} to {largest:.6e} N·m/rad")?;
            let error_deg = wind_up.transmission_error_peak_to_peak_deg;
            writeln!(writer, "transmission error, peak to peak    {error_deg:.3e} deg")?;
            if let Some(error_deg) = wind_up.unloaded_transmission_error_peak_to_peak_deg {
                writeln!(writer, "the same without load               {error_deg:.3e} deg")?;
            }
            if let Some(found) = &wind_up.backlash {
                backlash::write_text(found, writer)?;
            }
        }
        if let Some(losses) = &self.losses {
            losses::write_text(&losses.totals, writer)?;
        }
        if let Some(radial_force) = &self.radial_force_n {
            let most_n = radial_force.force_n.iter().copied().fold(0.0, f64::max);
            writeln!(writer, "\nlargest force on the wave generator {most_n:.6} N, across its axis")?;
        }
        model_error::write_text(&self.model_error, writer)?;
        backing::write_text(&self.series_compliance_estimates, writer)?;
        write_findings(&self.findings, writer)
    }
}
