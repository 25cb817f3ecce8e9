//! Columns of numbers, written sooner than by serde_json.

use serde_json::json;
use toothwave_calculation::columns::write;

fn text(value: &impl serde::Serialize) -> String {
    let mut text = Vec::new();
    write(value, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

#[test]
fn writes_same_bytes_as_serde_json() {
    for count in 0..40 {
        let column: Vec<_> = (0..count).map(|i| (f64::from(i / 3) * 0.1).tan()).collect();
        let equal: Vec<_> = (0..count).map(|_| -2.225_073_858_507_201_4e-308).collect();
        let points: Vec<_> = column.iter().map(|&x| [x, -x]).collect();
        let value = json!({
            "number": 1e300, "column": column, "teeth": [1, 2, 3], "points": points, "none": null, "equal": equal, "word": "é\n",
            "nested": [{"x": 0.5}, {"x": 0.5, "loaded": [true, false]}, {}, []], "last": 5e-324,
        });
        assert_eq!(text(&value), value.to_string());
        assert_eq!(text(&column), serde_json::to_string(&column).unwrap());
        assert_eq!(text(&points), serde_json::to_string(&points).unwrap());
    }
}

#[test]
fn writes_non_finite_numbers_as_null() {
    for values in [[f64::NAN, 1.5, 2.5], [1.5, f64::NAN, 2.5], [1.5, 2.5, f64::INFINITY]] {
        assert_eq!(text(&values), serde_json::to_string(&values).unwrap());
        assert_eq!(text(&[values; 9]), serde_json::to_string(&[values; 9]).unwrap());
    }
}

#[test]
fn keeps_sign_of_zero() {
    assert_eq!(text(&[0.0, -0.0, -0.0, 0.0]), "[0.0,-0.0,-0.0,0.0]");
}
