//! A sweep as text.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::PerContact;
use toothwave_solver::backing::Estimate;
use toothwave_solver::backlash::Backlash;
use toothwave_solver::fingers::FingerStress;
use toothwave_solver::losses::Efficiencies;
use toothwave_solver::losses::bearing::BearingLife;
use toothwave_solver::losses::duty::LossTotals;
use toothwave_solver::losses::period::LossByPlace;
use toothwave_solver::model_error::{ErrorRange, Held, Measured, ModelError};
use toothwave_solver::sweep::{Extremes, Peak};

use crate::findings::write_findings;
use crate::json::word;
use crate::sweep::answer::SweepAnswer;

/// Returns a word of the API, with spaces for underscores.
fn words(value: &impl Serialize) -> String {
    word(value).replace('_', " ")
}

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
            let name = words(&contact);
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
                format!("limited by {}", words(&capacity.limited_by))
            };
            writeln!(
                writer,
                "\ntorque capacity, input and output   {:.6} and {:.6} N·m, {limit} at {:.4} deg",
                capacity.input_torque_nm, capacity.output_torque_nm, capacity.input_angle_deg
            )?;
        }
        if let Some(stress) = &self.fingers {
            write_fingers(stress, writer)?;
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
                write_backlash(found, writer)?;
            }
        }
        if let Some(losses) = &self.losses {
            write_losses(&losses.totals, writer)?;
        }
        if let Some(radial_force) = &self.radial_force_n {
            let most_n = radial_force.force_n.iter().copied().fold(0.0, f64::max);
            writeln!(writer, "\nlargest force on the wave generator {most_n:.6} N, across its axis")?;
        }
        write_model_error(&self.model_error, writer)?;
        write_supports(&self.series_compliance_estimates, writer)?;
        write_findings(&self.findings, writer)
    }
}

fn write_fingers(stress: &FingerStress, writer: &mut dyn Write) -> io::Result<()> {
    writeln!(writer, "\nfingers of the carrier              {}", words(&stress.fingers))?;
    writeln!(writer, "stress at their feet                {:.1} MPa", stress.stress_mpa)?;
    if let Some((yielding, fatigue)) = stress.yield_safety.zip(stress.fatigue_safety) {
        writeln!(writer, "safety against yield, fatigue       {yielding:.2}, {fatigue:.2}")?;
    }
    Ok(())
}

fn write_backlash(backlash: &Backlash, writer: &mut dyn Write) -> io::Result<()> {
    let Backlash { mean_arcmin, smallest_arcmin, largest_arcmin, contribution_arcmin: parts, .. } = backlash;
    writeln!(
        writer,
        "backlash at the output              {mean_arcmin:.6} arcmin, {smallest_arcmin:.6} to {largest_arcmin:.6}"
    )?;
    writeln!(
        writer,
        "of which at generator, ring, slot   {:.6}, {:.6} and {:.6} arcmin",
        parts.wave_generator, parts.ring, parts.carrier
    )
}

fn write_losses(totals: &LossTotals, writer: &mut dyn Write) -> io::Result<()> {
    let Efficiencies { driven, back_driven } = totals.efficiency;
    let locks = if totals.self_locking { " (locks itself)" } else { "" };
    let (driven, back_driven) = (100.0 * driven, 100.0 * back_driven);
    writeln!(writer, "\nefficiency             driven   from behind")?;
    writeln!(writer, "ring fixed           {driven:>6.2} %      {back_driven:>6.2} %{locks}")?;
    let torque_nm = totals.required_input_torque_nm;
    writeln!(writer, "input torque with losses            {torque_nm:.6} N·m, ring fixed")?;
    if let Some(power_w) = totals.power_loss_w {
        writeln!(writer, "power lost, ring fixed              {power_w:.6} W")?;
    }
    let LossByPlace { wave_generator, ring, carrier, bearing } = totals.loss_ratio_by_place;
    for (name, ratio) in
        [("wave generator", wave_generator), ("ring", ring), ("carrier", carrier), ("bearing", bearing)]
    {
        // Without friction there is no share of the loss.
        let share = if totals.loss_ratio > 0.0 { ratio / totals.loss_ratio } else { 0.0 };
        writeln!(writer, "  of it at the {name:<14}         {:>6.2} %", 100.0 * share)?;
    }
    for (contact, peak) in totals.pressure_velocity_mpa_m_per_s.iter().flat_map(PerContact::iter) {
        let Peak { value, input_angle_deg, position_deg } = peak;
        let name = words(&contact);
        writeln!(writer, "{name:<14} p·v    {value:>14.3} MPa m/s {input_angle_deg:>5.4} deg {position_deg:>9.4} deg")?;
    }
    for (contact, wear) in totals.wear_mm_per_hour.iter().flat_map(PerContact::iter) {
        write!(writer, "{:<14} wear   {:>14.3e} mm/h    ", words(&contact), wear.value)?;
        match wear.input_angle_deg.zip(wear.position_deg) {
            Some((input_angle_deg, position_deg)) => {
                writeln!(writer, "{input_angle_deg:>5.4} deg {position_deg:>9.4} deg")?;
            }
            None => writeln!(writer, "all round")?,
        }
    }
    if let Some(BearingLife { mean_load_n, life_million_revolutions, speed_rpm, life_h }) = totals.bearing {
        writeln!(writer, "mean load on the bearing            {mean_load_n:.6} N")?;
        writeln!(writer, "its life                            {life_million_revolutions:.4e} million revolutions")?;
        if let Some((speed_rpm, life_h)) = speed_rpm.zip(life_h) {
            writeln!(writer, "                                    {life_h:.4e} h at {speed_rpm:.6} rpm")?;
        }
    }
    Ok(())
}

fn write_model_error(error: &ModelError, writer: &mut dyn Write) -> io::Result<()> {
    let percent = |ErrorRange { low, high }: &ErrorRange| format!("{:+.0} to {:+.0} %", 100.0 * low, 100.0 * high);
    match &error.measured {
        Some(Measured { case, force, stress, wind_up }) => {
            writeln!(
                writer,
                "\nmodel against elastic bodies        force {}, stress {}",
                percent(force),
                percent(stress)
            )?;
            writeln!(writer, "wind-up of bodies that are held     {}", percent(wind_up))?;
            let refined = [
                (case.ring_teeth_bend, "the ring's teeth bend"),
                (case.wave_generator_moves, "the wave generator moves on under its teeth"),
                (case.corner_contact, "teeth meet the corners of tips"),
            ];
            let refined: Vec<_> = refined.into_iter().filter(|(is, _)| *is).map(|(_, words)| words).collect();
            if !refined.is_empty() {
                writeln!(writer, "refined                             {}", refined.join(", "))?;
            }
        }
        None => writeln!(writer, "\nmodel against elastic bodies        not measured")?,
    }
    if let Some(Held { case, wind_up, estimated_wind_up }) = &error.held {
        let earlier = wind_up.as_ref().map_or_else(String::new, |range| format!("{}, ", percent(range)));
        writeln!(
            writer,
            "wind-up besides, {:<18} {earlier}estimated {:+.0} %",
            words(case),
            100.0 * estimated_wind_up
        )?;
    }
    if error.is_within {
        return writeln!(writer, "this design                         within the range of those measured");
    }
    let beyond: Vec<_> = error.beyond.iter().map(word).collect();
    writeln!(writer, "this design                         beyond the range of those measured: {}", beyond.join(", "))
}

fn write_supports(estimates: &[Estimate], writer: &mut dyn Write) -> io::Result<()> {
    if estimates.is_empty() {
        return Ok(());
    }
    writeln!(writer, "\nbehind the contacts, estimated       mm/N   adds to a tooth's approach")?;
    for Estimate { contact, backing, compliance_mm_per_n, share, .. } in estimates {
        let name = format!("{}, {}", words(contact), words(backing));
        write!(writer, "{name:<33} {compliance_mm_per_n:.3e}")?;
        match share {
            Some(share) => writeln!(writer, "   {:.0} %", 100.0 * share)?,
            None => writeln!(writer)?,
        }
    }
    Ok(())
}
