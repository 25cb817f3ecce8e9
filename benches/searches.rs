//! How near searches come to fronts and relaxations that are known by other means: `cargo bench --bench searches` prints shares and needs as
//! JSON; with a name only those that have it in theirs. `benches/searches.json` has those of ten seeds.
//!
//! The truth comes from the closed forms of docs/explanation/theory.md (sections 2.1, 2.5 and 7) on a dense grid, that of stresses from the solver on a
//! grid of shapes, and none of it from the search.
#![allow(clippy::unwrap_used, reason = "what fails here has no reader but the terminal")]

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};
use toothwave_calculation::forms::{Format, Forms as _};
use toothwave_calculation::question;
use toothwave_solver::Never;
use toothwave_study::{Gathered, Limits, Study, Work};

/// The service's own.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const LIMITS: Limits = Limits {
    calculation: question::Limits::new(1_000_000, 1_000_000),
    max_study_variants: 1_000_000_000,
    max_study_bytes: 1 << 34,
};

const SEEDS: std::ops::RangeInclusive<u64> = 1..=10;

/// Values along each side of a grid of the truth.
const GRID: u32 = 2000;

/// What is free beside the number of teeth: the axes of the ellipse and the teeth's radius.
const MAJOR_MM: (f64, f64) = (40.0, 60.0);
const MINOR_MM: (f64, f64) = (36.0, 60.0);
const TOOTH_RADIUS_MM: (f64, f64) = (1.0, 8.0);

/// The thinnest wall between slots that is allowed.
const WALL_MM: f64 = 1.5;

/// The corner of the hypervolume: the largest root radius, the least tooth height, the least contact ratio and transmission ratio.
const CORNER: [f64; 3] = [75.0, 0.0, 9.5];

/// The numbers of teeth among which a search chooses.
const TEETH: (f64, f64) = (20.0, 24.0);

/// One shape of an ellipse with its teeth, all lengths in mm.
#[derive(Clone, Copy)]
struct Shape {
    major: f64,
    tooth_radius: f64,
    teeth: f64,
}

impl Shape {
    /// Section 7: the wall between two slots at the cam's outer radius.
    fn wall(self) -> f64 {
        let (a, r) = (self.major, self.tooth_radius);
        let (sin, cos) = (PI / self.teeth).sin_cos();
        2.0 * ((a * a - r * r).sqrt() * sin - r * cos)
    }

    fn root(self) -> f64 {
        self.major + 2.0 * self.tooth_radius
    }

    /// Section 2.5: whether the ring's tips stay whole; a carrier needs room besides, the tips outside the cam.
    fn is_possible(self, minor: f64) -> bool {
        let (a, b, r) = (self.major, minor, self.tooth_radius);
        let k = 0.5 * (self.teeth - 2.0);
        (b + 2.0 * r) * (a * a + b * r) >= r * k * k * (a * a - b * b) && b + 2.0 * r > a && b < a && b >= MINOR_MM.0
    }

    /// The largest tooth height without undercut, `a - b`.
    fn height(self) -> Option<f64> {
        let (mut low, mut high) = (MINOR_MM.0, self.major * (1.0 - 1e-9));
        if !self.is_possible(high) {
            return None;
        }
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            *(if self.is_possible(middle) { &mut high } else { &mut low }) = middle;
        }
        Some(self.major - high)
    }
}

fn between((low, high): (f64, f64), index: u32) -> f64 {
    low + f64::from(index) / f64::from(GRID) * (high - low)
}

/// All shapes of a grid over root radius and tooth radius within the ranges, walls thick enough.
fn shapes(teeth: f64, wall_mm: f64) -> impl Iterator<Item = Shape> {
    let roots = (MAJOR_MM.0 + 2.0 * TOOTH_RADIUS_MM.0, MAJOR_MM.1 + 2.0 * TOOTH_RADIUS_MM.1);
    let cells = (0..=GRID).flat_map(|root| (0..=GRID).map(move |radius| (root, radius)));
    let shape = move |(root, radius)| {
        let tooth_radius = between(TOOTH_RADIUS_MM, radius);
        Shape { major: between(roots, root) - 2.0 * tooth_radius, tooth_radius, teeth }
    };
    cells.map(shape).filter(move |shape| (MAJOR_MM.0..=MAJOR_MM.1).contains(&shape.major) && shape.wall() >= wall_mm)
}

/// The front of root radius (least) and tooth height (largest) of so many teeth.
fn front(teeth: f64) -> Vec<[f64; 2]> {
    let mut best: BTreeMap<u64, [f64; 2]> = BTreeMap::new();
    for shape in shapes(teeth, WALL_MM) {
        if let Some(height) = shape.height() {
            let one = best.entry(shape.root().to_bits() >> 12).or_insert([shape.root(), height]);
            one[1] = one[1].max(height);
        }
    }
    best.into_values().collect()
}

/// The area between points and the corner; the first is to be least, the second largest.
fn area(points: impl IntoIterator<Item = [f64; 2]>) -> f64 {
    let mut points: Vec<_> = points.into_iter().filter(|point| point[0] < CORNER[0]).collect();
    points.sort_by(|one, other| one[0].total_cmp(&other[0]));
    let mut highest = CORNER[1];
    let mut sum = 0.0;
    for [root, height] in points {
        sum += (CORNER[0] - root) * (height - highest).max(0.0);
        highest = highest.max(height);
    }
    sum
}

/// The volume between points and the corner; the third is to be largest. Each slice has what reaches as high.
fn volume(points: &[[f64; 3]]) -> f64 {
    let mut levels: Vec<_> = points.iter().map(|point| point[2]).filter(|level| *level > CORNER[2]).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let mut below = CORNER[2];
    let mut sum = 0.0;
    for level in levels {
        let slice = points.iter().filter(|point| point[2] >= level).map(|point| [point[0], point[1]]);
        sum += (level - below) * area(slice);
        below = level;
    }
    sum
}

/// What is known of a search: the hypervolume of its front, or how far each limit must be relaxed.
enum Truth {
    Volume { value: f64, third: Option<&'static str> },
    Relaxations(Vec<(&'static str, f64)>),
}

struct Case {
    name: &'static str,
    document: Value,
    truth: Truth,
}

fn range((min, max): (f64, f64)) -> Value {
    json!({ "min": min, "max": max })
}

/// A search for small rings with high teeth.
fn geometry(teeth: (f64, f64), third: Option<&str>) -> Value {
    let mut base = json!({ "drive": { "wave_generator": {}, "teeth": { "width_mm": 15.0 } } });
    let mut free = json!({
        "/drive/wave_generator/semi_major_mm": range(MAJOR_MM), "/drive/wave_generator/semi_minor_mm": range(MINOR_MM),
        "/drive/teeth/radius_mm": range(TOOTH_RADIUS_MM)
    });
    if teeth.0 < teeth.1 {
        free["/drive/teeth/count"] = range(teeth);
    } else {
        base["drive"]["teeth"]["count"] = json!(teeth.0);
        base["drive"]["ring"] = json!({ "teeth": teeth.0 - 2.0 });
    }
    let mut objectives = vec![
        json!({ "quantity": "ring_root_radius_mm", "goal": "min" }),
        json!({ "quantity": "ring_tooth_height_mm", "goal": "max" }),
    ];
    objectives.extend(third.map(|name| json!({ "quantity": name, "goal": "max" })));
    let require = json!({ "undercut": false, "slot_wall_mm": { "min": WALL_MM } });
    json!({ "study": "search", "base": base, "free": free, "require": require, "objectives": objectives })
}

/// The case that a user sent: of two limits that can be relaxed one was missing, or too large.
fn stressed() -> Value {
    json!({
        "study": "search",
        "base": {
            "drive": { "teeth": { "count": 100 }, "ring": { "teeth": 98 } },
            "load": { "output_torque_nm": 400.0 },
            "model": { "compatibility": "virtual_work", "stiffness": { "law": "palmgren" } },
            "sweep": { "samples": 50 }
        },
        "free": {
            "/drive/wave_generator/semi_major_mm": { "min": 5.0, "max": 200.0 },
            "/drive/wave_generator/semi_minor_mm": { "min": 5.0, "max": 200.0 },
            "/drive/teeth/radius_mm": { "min": 0.05, "max": 8.0 }, "/drive/teeth/width_mm": { "min": 1.0, "max": 10.0 }
        },
        "require": { "ring_root_radius_mm": { "max": 30.0 }, "peak_stress_mpa": { "max": 900.0 }, "undercut": false },
        "objectives": [{ "quantity": "ring_root_radius_mm", "goal": "min" }]
    })
}

/// The least stress of that case at a root radius of 30 mm, over shapes. Forces share alike at every size, as all contacts follow the same
/// power of force, so that the stress falls with the size: their product is the same for each shape.
fn least_stress_mpa() -> f64 {
    let base = stressed()["base"].clone();
    let at = |radius_mm: f64, heights: Value| {
        let mut base = base.clone();
        let major_mm = 30.0 - 2.0 * radius_mm;
        base["drive"]["wave_generator"] = json!({ "semi_major_mm": major_mm });
        base["drive"]["teeth"] = json!({ "count": 100, "radius_mm": radius_mm, "width_mm": 10.0 });
        let (low, high) = (heights["min"].as_f64().unwrap(), heights["max"].as_f64().unwrap());
        let over = json!({ "/drive/wave_generator/semi_minor_mm":
            { "min": major_mm - high, "max": major_mm - low, "steps": 300 } });
        let map = json!({ "study": "map", "base": base, "over": over, "quantities": ["peak_stress_mpa", "undercut"] });
        let (found, _) = answered(&map);
        let column = |name: &str| found["possible"]["quantities"][name].as_array().unwrap().clone();
        let stresses = column("peak_stress_mpa").into_iter().zip(column("undercut"));
        let stresses = stresses.filter(|(_, undercut)| undercut.as_f64() == Some(0.0));
        stresses.map(|(stress, _)| stress.as_f64().unwrap()).fold(f64::INFINITY, f64::min)
    };
    // From a tenth of a tooth's pitch to the teeth that touch, and over all heights.
    (10..=300)
        .map(|radius| at(0.003 * f64::from(radius), json!({ "min": 1e-4, "max": 1.0 })))
        .fold(f64::INFINITY, f64::min)
}

fn cases(wanted: &dyn Fn(&str) -> bool) -> Vec<Case> {
    let mut cases = Vec::new();
    let mut add = |name: &'static str, document: Value, truth: &dyn Fn() -> Truth| {
        if wanted(name) {
            cases.push(Case { name, document, truth: truth() });
        }
    };
    let fixed = (28.0, 28.0);
    add("ordinary", geometry(fixed, None), &|| Truth::Volume { value: area(front(28.0)), third: None });
    // Without undercut the contact ratio is half the number of teeth, whatever the rest.
    add("plateau", geometry(fixed, Some("coincidence_degree")), &|| Truth::Volume {
        value: (14.0 - CORNER[2]) * area(front(28.0)),
        third: Some("coincidence_degree"),
    });
    add("whole numbers", geometry(TEETH, Some("transmission_ratio")), &|| {
        let counts = (0_u32..=4).map(|more| TEETH.0 + f64::from(more));
        let points: Vec<_> =
            counts.flat_map(|teeth| front(teeth).into_iter().map(move |[x, y]| [x, y, 0.5 * teeth])).collect();
        Truth::Volume { value: volume(&points), third: Some("transmission_ratio") }
    });
    let (root_mm, height_mm) = (54.0, 2.6);
    let limited = |teeth, wall_mm: f64, ratio: f64| {
        let mut document = geometry(teeth, None);
        document["require"]["slot_wall_mm"]["min"] = json!(wall_mm);
        document["require"]["ring_root_radius_mm"] = json!({ "max": root_mm });
        document["require"]["ring_tooth_height_mm"] = json!({ "min": height_mm });
        document["require"]["transmission_ratio"] = json!({ "min": ratio });
        document
    };
    let high = |teeth, wall_mm| shapes(teeth, wall_mm).filter(|shape| shape.is_possible(shape.major - height_mm));
    let least_root = |teeth, wall_mm| high(teeth, wall_mm).map(Shape::root).fold(f64::INFINITY, f64::min);
    add("infeasible geometry", limited(fixed, 10.0, 14.0), &|| {
        let walls = high(28.0, 0.0).filter(|shape| shape.root() <= root_mm).map(Shape::wall);
        Truth::Relaxations(vec![
            ("ring_root_radius_mm", least_root(28.0, 10.0)),
            ("slot_wall_mm", walls.fold(0.0, f64::max)),
        ])
    });
    add("infeasible whole numbers", limited((20.0, 40.0), 7.5, 16.0), &|| {
        let counts = || (20_u32..=40).map(f64::from);
        let ratios = counts().filter(|&teeth| least_root(teeth, 7.5) <= root_mm).map(|teeth| 0.5 * teeth);
        let fast = || counts().filter(|&teeth| teeth >= 32.0);
        let heights = |teeth| shapes(teeth, 7.5).filter(|shape| shape.root() <= root_mm).filter_map(Shape::height);
        Truth::Relaxations(vec![
            ("transmission_ratio", ratios.fold(0.0, f64::max)),
            ("ring_root_radius_mm", fast().map(|teeth| least_root(teeth, 7.5)).fold(f64::INFINITY, f64::min)),
            ("ring_tooth_height_mm", fast().flat_map(heights).fold(0.0, f64::max)),
        ])
    });
    add("infeasible stress", stressed(), &|| {
        let stress_mpa = least_stress_mpa();
        Truth::Relaxations(vec![("peak_stress_mpa", stress_mpa), ("ring_root_radius_mm", 30.0 * stress_mpa / 900.0)])
    });
    cases
}

/// What a study comes to on one core, with the seconds that it takes.
fn answered(document: &Value) -> (Value, f64) {
    let study = Arc::new(Study::read(document.to_string().as_bytes(), &LIMITS).unwrap());
    let started = Instant::now();
    let mut gathered = Gathered::new(&study);
    for chunk in 0..study.chunks() {
        gathered.add(chunk, Work::new(&study, chunk).run(&Never).unwrap());
    }
    let answer = gathered.answer();
    let seconds = started.elapsed().as_secs_f64();
    let mut text = Vec::new();
    answer.write(Format::Json, &mut text).unwrap();
    (serde_json::from_slice(&text).unwrap(), seconds)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// The share of the true hypervolume that a front has.
fn share(answer: &Value, value: f64, third: Option<&str>) -> f64 {
    let point = |found: &Value| {
        let quantity = |name: &str| number(&found["quantities"][name]);
        let third = third.map_or(CORNER[2] + 1.0, quantity);
        [quantity("ring_root_radius_mm"), quantity("ring_tooth_height_mm"), third]
    };
    let points: Vec<_> = answer["front"].as_array().unwrap().iter().map(point).collect();
    volume(&points) / value
}

fn run(case: &Case) -> Value {
    let mut result = json!({});
    let asked = |evaluations: u64, seed: u64| {
        let mut document = case.document.clone();
        document["evaluations"] = json!(evaluations);
        document["seed"] = json!(seed);
        answered(&document)
    };
    let mut rates = Vec::new();
    match &case.truth {
        Truth::Volume { value, third } => {
            result["true_hypervolume"] = json!(value);
            for evaluations in [50_000, 100_000, 200_000] {
                let shares = SEEDS.map(|seed| {
                    let (answer, seconds) = asked(evaluations, seed);
                    rates.push(number(&answer["evaluated"]) / seconds);
                    (1e6 * share(&answer, *value, *third)).floor() / 1e6
                });
                result["shares_of_hypervolume"][evaluations.to_string()] = json!(shares.collect::<Vec<_>>());
            }
        }
        Truth::Relaxations(truth) => {
            for (name, value) in truth {
                result["true_relaxations"][*name] = json!(value);
            }
            for seed in SEEDS {
                let (answer, seconds) = asked(50_000, seed);
                rates.push(number(&answer["evaluated"]) / seconds);
                for (name, _) in truth {
                    let found = answer["relaxations"].as_array().unwrap().iter();
                    let mut needed =
                        found.filter(|relaxed| relaxed["quantity"] == *name).map(|one| one["needed"].clone());
                    let found = result["relaxations"][*name].take();
                    let mut found = found.as_array().cloned().unwrap_or_default();
                    found.push(needed.next_back().unwrap_or(Value::Null));
                    result["relaxations"][*name] = json!(found);
                }
            }
        }
    }
    rates.sort_by(f64::total_cmp);
    result["median_evaluations_per_second"] = json!(rates[rates.len() / 2].round());
    result
}

fn main() {
    let wanted: Vec<_> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|wanted| name.contains(wanted.as_str()));
    let results: serde_json::Map<_, _> =
        cases(&is_wanted).iter().map(|case| (case.name.to_owned(), run(case))).collect();
    println!("{}", serde_json::to_string_pretty(&results).unwrap());
}
