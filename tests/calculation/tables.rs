//! A sweep's states as an Arrow stream, with the columns of CSV and JSON.

use arrow_array::{Array, BooleanArray, Float64Array, StringArray, UInt32Array};
use arrow_ipc::reader::StreamReader;
use serde_json::{Value, json};
use toothwave_calculation::forms::{Format, Forms as _};
use toothwave_calculation::question::{Limits, Question as _};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;

const LIMITS: Limits = Limits::new(1_000_000, 1);

fn drive() -> Value {
    json!({
        "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
        "teeth": { "count": 28, "radius_mm": 5.0, "width_mm": 15.0 },
        "ring": { "teeth": 26 }
    })
}

/// Returns an entry as JSON.
fn entry(column: &dyn Array, row: usize) -> Value {
    let column = column.as_any();
    if let Some(numbers) = column.downcast_ref::<Float64Array>() {
        json!(numbers.value(row))
    } else if let Some(counts) = column.downcast_ref::<UInt32Array>() {
        json!(counts.value(row))
    } else if let Some(flags) = column.downcast_ref::<BooleanArray>() {
        json!(flags.value(row))
    } else {
        json!(column.downcast_ref::<StringArray>().unwrap().value(row))
    }
}

#[test]
fn arrow_stream_has_csv_columns_and_json_numbers() {
    let friction = json!({ "wave_generator": { "kind": "plain", "coefficient": 0.03 }, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.04 } });
    for document in [
        // The sweep has more states than a batch holds.
        json!({ "drive": drive(), "load": { "input_torque_nm": 20.0 }, "sweep": { "samples": 10_000 } }),
        json!({ "drive": drive(), "load": { "input_torque_nm": 20.0 }, "friction": friction, "model": { "clearance": { "ring_um": 5.0 } } }),
        json!({ "drive": drive(), "load": { "input_torque_nm": 20.0 }, "deviations": { "wave_generator_lobe_um": [0.0, 1.0] }, "model": { "clearance": { "wave_generator_um": 5.0 } }, "sweep": { "samples": 5 } }),
    ] {
        let answer = Sweep.ask(document.to_string().as_bytes(), &LIMITS, &Never).unwrap();
        let written = |format| {
            let mut bytes = Vec::new();
            answer.write(format, &mut bytes).unwrap();
            bytes
        };
        let csv = written(Format::Csv);
        let head = csv.split(|&byte| byte == b'\n').next().unwrap();
        let answer: Value = serde_json::from_slice(&written(Format::Json)).unwrap();
        let mut columns = answer["states"].clone();
        if let Some(losses) = answer.get("losses") {
            for contact in ["wave_generator", "ring", "carrier"] {
                columns[format!("slip_{contact}_mm_per_rad")] = losses["slip_mm_per_rad"][contact].clone();
            }
            columns["rolls"] = losses["rolls"].clone();
        }
        let bytes = written(Format::Arrow);
        let mut states = 0;
        for batch in StreamReader::try_new(bytes.as_slice(), None).unwrap() {
            let batch = batch.unwrap();
            let schema = batch.schema();
            let names: Vec<_> = schema.fields().iter().map(|field| field.name().as_str()).collect();
            assert_eq!(names.join(",").as_bytes(), head);
            assert_eq!(names.len(), columns.as_object().unwrap().len());
            for (name, column) in names.iter().zip(batch.columns()) {
                for row in 0..batch.num_rows() {
                    assert_eq!(entry(column, row), columns[*name][states + row], "{name}");
                }
            }
            states += batch.num_rows();
        }
        assert_eq!(states, columns["tooth"].as_array().unwrap().len());
    }
}

/// A growing buffer takes its memory twice. With few teeth, columns by input angle are as long as the state columns.
#[test]
fn json_length_of_sweep_is_known_beforehand() {
    let friction = json!({ "wave_generator": { "kind": "plain", "coefficient": 0.03 }, "ring": { "coefficient": 0.05 }, "carrier": { "coefficient": 0.04 } });
    let eccentric = json!({
        "wave_generator": { "kind": "eccentric", "radius_mm": 30.8, "eccentricity_mm": 1.2 },
        "teeth": { "count": 24, "installed": 4, "radius_mm": 3.0, "width_mm": 15.0 },
        "ring": { "teeth": 23 }
    });
    let sweep = json!({ "samples": 20_000, "wind_up": true });
    let clearance = json!({ "clearance": { "ring_um": 5.0 } });
    for document in [
        json!({ "drive": drive(), "load": { "input_torque_nm": 20.0 }, "sweep": { "samples": 5_000 } }),
        json!({ "drive": drive(), "load": { "input_torque_nm": 20.0 }, "friction": friction, "model": clearance, "sweep": sweep }),
        json!({ "drive": eccentric, "load": { "input_torque_nm": 1.0 }, "friction": friction, "model": { "clearance": { "ring_um": 0.5 } }, "sweep": sweep }),
    ] {
        let answer = Sweep.ask(document.to_string().as_bytes(), &LIMITS, &Never).unwrap();
        let mut bytes = Vec::new();
        answer.write(Format::Json, &mut bytes).unwrap();
        let share = answer.expected_bytes() as f64 / bytes.len() as f64;
        // Efficiencies of zero have short text.
        assert!((1.0..1.35).contains(&share), "{share} of {} bytes", bytes.len());
    }
}
