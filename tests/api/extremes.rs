//! Random extreme drives. The service answers with finite numbers or a reason.

use serde_json::{Value, json};

use crate::asking::{ENDPOINTS, LIMITS, Limits, Service};
use crate::designs::{fixed, pointers};

/// A reproducible random generator (Knuth's MMIX).
struct Dice(u64);

impl Dice {
    /// Returns a number from 0 to 1.
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns a number between two powers of ten, uniform in its logarithm.
    fn order(&mut self, low: f64, high: f64) -> f64 {
        10.0_f64.powf(self.between(low, high))
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        let drawn = self.unit() * choices.len() as f64;
        let index = (1..choices.len()).take_while(|&index| index as f64 <= drawn).count();
        choices[index]
    }

    fn material(&mut self) -> Value {
        json!({ "youngs_modulus_gpa": self.order(-3.0, 5.0), "poissons_ratio": self.between(-0.999_999, 0.499_999) })
    }

    /// Returns a document with every number within its range. The numbers need not fit each other.
    fn document(&mut self) -> Value {
        let semi_major_mm = self.order(-5.9, 6.0);
        let semi_minor_mm = (semi_major_mm * (1.0 - self.order(-14.0, 0.0))).max(1e-6);
        let radius_mm = (semi_major_mm * self.order(-5.0, 0.5)).clamp(1e-6, 1e6);
        let (half, removal) = (self.order(0.0, 2.5).round(), self.one_of(&[1.0, 1.0, 2.0, 3.0]));
        let (installed, count) = (2.0 * half, 2.0 * half * removal);
        let tip = self.between(-1.0, 1.0);
        let tip_radius_mm = (semi_minor_mm + 2.0 * radius_mm + tip * (semi_major_mm - semi_minor_mm)).clamp(1e-6, 1e6);
        let law = if self.unit() < 0.5 {
            json!({ "law": "linear" })
        } else {
            fixed(self.order(-3.0, 15.0), self.order(-3.0, 15.0), self.order(-3.0, 15.0))
        };
        json!({
            "drive": {
                "wave_generator": { "semi_major_mm": semi_major_mm, "semi_minor_mm": semi_minor_mm },
                "teeth": { "count": count, "installed": installed, "radius_mm": radius_mm, "width_mm": self.order(-6.0, 6.0) },
                "ring": { "teeth": (count + self.one_of(&[-2.0, 2.0])).max(2.0), "tip_radius_mm": (tip > 0.0).then_some(tip_radius_mm) }
            },
            "materials": {
                "wave_generator": self.material(), "teeth": self.material(), "ring": self.material(), "carrier": self.material()
            },
            "load": { self.one_of(&["input_torque_nm", "output_torque_nm"]): self.order(-12.0, 15.0) },
            "model": { "compatibility": self.one_of(&["projection", "virtual_work"]), "stiffness": law },
            "sweep": { "samples": self.one_of(&[1, 2, 3, 10]) },
            "profile": {
                "chord_tolerance_mm": (radius_mm * self.order(-4.0, 2.0)).clamp(1e-6, 1e6),
                "extent": self.one_of(&["tooth", "full"])
            }
        })
    }
}

#[tokio::test]
async fn any_numbers_get_finite_answer_or_reason() {
    let service = Service::within(Limits { max_states: 5_000, cache_max_bytes: 0, ..LIMITS });
    let mut dice = Dice(2013);
    let mut answered = 0;
    for _ in 0..300 {
        let document = dice.document();
        for path in ENDPOINTS {
            let answer = service.post(path, &document).await;
            if answer.status != 200 {
                answer.problem();
                assert_eq!(answer.status, 422, "{path}: {document}");
                continue;
            }
            let found = answer.found();
            assert!(pointers(&found, Value::is_null).is_empty(), "{path}: {document}");
            answered += 1;
            if path == "/v1/sweep" {
                let residual = |name: &str| found["checks"][name].as_f64().unwrap();
                assert!(residual("torque_balance_residual") <= 1e-12, "{document}");
                assert!(residual("period_closure_residual") <= 1e-9, "{document}");
            }
        }
    }
    assert!(answered > 300, "{answered} of 900 are answered: the others tell little");
}
