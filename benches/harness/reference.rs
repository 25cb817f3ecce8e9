//! The cases of the 60-digit calculation in tests/reference.

use std::error::Error;

use serde_json::Value;
use toothwave_solver::parts::CarrierRadii;
use toothwave_solver::{
    Compatibility, ContactLaw, DriveParameters, LoadParameters, Material, Materials, Modification, PerContact,
    ToothShape, Torque, WaveGenerator,
};

use crate::baselines::{COLUMNS, Columns};

/// The file.
#[derive(Debug)]
pub(crate) struct Reference(Value);

/// A drive and its load.
#[derive(Debug, Clone)]
pub(crate) struct Setup {
    pub(crate) drive: DriveParameters,
    pub(crate) load: LoadParameters,
    pub(crate) input_torque_nm: f64,
}

impl Setup {
    /// The paper's case 5.1, projection: for measurements of memory, which reading the file would disturb.
    pub(crate) const PAPER_5_1: Self = Self {
        drive: DriveParameters {
            wave_generator: WaveGenerator::Ellipse { semi_major_mm: 58.0, semi_minor_mm: 56.0 },
            teeth: 28,
            installed: 28,
            tooth_radius_mm: 5.0,
            tooth: ToothShape::Cylinder { width_mm: 15.0 },
            ring_teeth: 26,
            tip_radius_mm: None,
        },
        load: LoadParameters {
            materials: Materials {
                wave_generator: Material::STEEL,
                teeth: Material::STEEL,
                ring: Material::STEEL,
                carrier: Material::STEEL,
            },
            torque: Torque::Input(20.0),
            compatibility: Compatibility::Projection,
            law: ContactLaw::Linear,
            series_compliance_mm_per_n: PerContact { wave_generator: 0.0, ring: 0.0, carrier: 0.0 },
            ring_teeth_bend: false,
            wave_generator_moves: false,
            corner_contact: false,
            clearance_um: PerContact { wave_generator: 0.0, ring: 0.0, carrier: 0.0 },
            modification: Modification::NONE,
            carrier: CarrierRadii { inner_mm: None, outer_mm: None },
            allowable_stress_mpa: None,
        },
        input_torque_nm: 20.0,
    };
}

impl Reference {
    pub(crate) fn read() -> Result<Self, Box<dyn Error>> {
        Ok(Self(serde_json::from_str(include_str!("../../tests/reference/cases.json"))?))
    }

    fn case(&self, name: &str) -> Result<&Value, Box<dyn Error>> {
        let cases = self.0["cases"].as_array();
        let case = cases.into_iter().flatten().find(|case| case["name"] == name);
        Ok(case.ok_or_else(|| format!("the reference has no case {name:?}"))?)
    }

    /// A case with the linear law and its torque at the input, as all have that benchmarks speak of.
    pub(crate) fn setup(&self, name: &str) -> Result<Setup, Box<dyn Error>> {
        let document = &self.case(name)?["document"];
        let number = |pointer: &str| {
            let value = document.pointer(pointer).and_then(Value::as_f64);
            value.ok_or_else(|| format!("case {name:?} has no {pointer}"))
        };
        let count = |pointer: &str| {
            let value = document.pointer(pointer).and_then(Value::as_i64);
            value.ok_or_else(|| format!("case {name:?} has no {pointer}"))
        };
        let material = |part: &str| -> Result<Material, String> {
            Ok(Material {
                youngs_modulus_gpa: number(&format!("/materials/{part}/youngs_modulus_gpa"))?,
                poissons_ratio: number(&format!("/materials/{part}/poissons_ratio"))?,
            })
        };
        let model = &document["model"];
        if model["stiffness"]["law"] != "linear" || model["compatibility"] != "projection" {
            return Err(format!("case {name:?} has another model").into());
        }
        let input_torque_nm = number("/load/input_torque_nm")?;
        Ok(Setup {
            drive: DriveParameters {
                wave_generator: WaveGenerator::Ellipse {
                    semi_major_mm: number("/drive/wave_generator/semi_major_mm")?,
                    semi_minor_mm: number("/drive/wave_generator/semi_minor_mm")?,
                },
                teeth: count("/drive/teeth/count")?,
                installed: count("/drive/teeth/installed")?,
                tooth_radius_mm: number("/drive/teeth/radius_mm")?,
                tooth: ToothShape::Cylinder { width_mm: number("/drive/teeth/width_mm")? },
                ring_teeth: count("/drive/ring/teeth")?,
                tip_radius_mm: number("/drive/ring/tip_radius_mm").ok(),
            },
            load: LoadParameters {
                materials: Materials {
                    wave_generator: material("wave_generator")?,
                    teeth: material("teeth")?,
                    ring: material("ring")?,
                    carrier: material("carrier")?,
                },
                torque: Torque::Input(input_torque_nm),
                compatibility: Compatibility::Projection,
                law: ContactLaw::Linear,
                series_compliance_mm_per_n: PerContact::default(),
                ring_teeth_bend: false,
                wave_generator_moves: false,
                corner_contact: false,
                clearance_um: PerContact::default(),
                modification: Modification::NONE,
                carrier: CarrierRadii { inner_mm: None, outer_mm: None },
                allowable_stress_mpa: None,
            },
            input_torque_nm,
        })
    }

    /// The largest error of a sweep over its column's peak, and the index of that column, over the states that the reference has.
    pub(crate) fn largest_error(
        &self,
        name: &str,
        columns: &Columns,
        intervals: i64,
    ) -> Result<(f64, usize), Box<dyn Error>> {
        let case = self.case(name)?;
        let expected = &case["expected"];
        let samples = case["document"]["sweep"]["samples"].as_i64().ok_or("no samples")?;
        let whole = |name: &str| expected["rows"][name].as_array().ok_or("no rows");
        let mut worst = (0.0, 0);
        for (row, (index, tooth)) in whole("input_index")?.iter().zip(whole("tooth")?).enumerate() {
            // Every input angle of the reference is one of the sweep's.
            let index = index.as_i64().ok_or("no index")? * (intervals / samples);
            let tooth = tooth.as_i64().ok_or("no tooth")?;
            let at = place(columns, index, tooth).ok_or("a state is missing")?;
            for (column, name) in COLUMNS.iter().enumerate() {
                let digits = |value: &Value| value.as_str().and_then(|text| text.parse::<f64>().ok());
                let value = digits(&expected["rows"][*name][row]).ok_or("no value")?;
                let peak = digits(&expected["column_peak"][*name]).ok_or("no peak")?;
                let error = (columns.values[column][at] - value).abs() / peak;
                // A value that is not a number is the worst of all.
                if error.is_nan() || error > worst.0 {
                    worst = (error, column);
                }
            }
        }
        Ok(worst)
    }
}

/// Where the state of a tooth stands that meshes at an input angle.
fn place(columns: &Columns, index: i64, tooth: i64) -> Option<usize> {
    let angles = &columns.values[0];
    let mut passed = 0;
    (0..angles.len()).find(|&at| {
        passed += i64::from(at > 0 && angles[at] > angles[at - 1]);
        passed == index && columns.tooth[at] == tooth
    })
}
