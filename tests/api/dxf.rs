//! AutoCAD's requirements for DXF. Each line of the list in docs/reference/dxf.md has a test.

use std::collections::{HashMap, HashSet};
use std::f64::consts::FRAC_PI_2;

use serde_json::{Value, json};

use crate::asking::{Question, Service};
use crate::designs::{bored, eccentric, shortest, undercut, with};
use crate::profiles::{Point, geometry};

/// A group code and its value.
type Pair = (i32, String);

const PARTS: [&str; 5] = ["ring", "wave-generator", "carrier", "tooth", "assembly"];

/// Returns the pairs of every part's drawing.
async fn drawings() -> Vec<Vec<Pair>> {
    let mut drawings = Vec::new();
    for part in PARTS {
        for document in [shortest(), bored()] {
            drawings.push(pairs(part, &document).await);
        }
    }
    drawings
}

async fn pairs(part: &str, document: &Value) -> Vec<Pair> {
    let question =
        Question::post(&format!("/v1/drawings/{part}"), document.to_string()).with("accept", "image/vnd.dxf");
    let answer = Service::new().ask(&question).await;
    let lines: Vec<_> = answer.text().split("\r\n").collect();
    assert_eq!((lines.len() % 2, lines.last()), (1, Some(&"")), "pairs of lines");
    lines.chunks_exact(2).map(|pair| (pair[0].trim().parse().unwrap(), pair[1].to_owned())).collect()
}

/// Returns the pairs between a section's name and its end.
fn section<'a>(pairs: &'a [Pair], name: &str) -> &'a [Pair] {
    let is = |pair: &Pair, code: i32, value: &str| pair.0 == code && pair.1 == value;
    let start = pairs.windows(2).position(|two| is(&two[0], 0, "SECTION") && is(&two[1], 2, name));
    let start = start.unwrap_or_else(|| panic!("no section {name}")) + 2;
    let end = pairs[start..].iter().position(|pair| is(pair, 0, "ENDSEC")).unwrap();
    &pairs[start..start + end]
}

/// Splits a section into objects, each from one group 0 to the next.
fn objects(pairs: &[Pair]) -> Vec<&[Pair]> {
    let mut starts: Vec<_> = (0..pairs.len()).filter(|&index| pairs[index].0 == 0).collect();
    starts.push(pairs.len());
    starts.windows(2).map(|two| &pairs[two[0]..two[1]]).collect()
}

fn value(object: &[Pair], code: i32) -> &str {
    let found = object.iter().find(|pair| pair.0 == code);
    &found.unwrap_or_else(|| panic!("no group {code} in {object:?}")).1
}

/// Returns the head and the records of a table.
fn table<'a>(pairs: &'a [Pair], name: &str) -> (&'a [Pair], Vec<&'a [Pair]>) {
    let objects = objects(section(pairs, "TABLES"));
    let start = objects.iter().position(|object| object[0].1 == "TABLE" && object[1].1 == name);
    let start = start.unwrap_or_else(|| panic!("no table {name}"));
    let records = objects[start + 1..].iter().take_while(|object| object[0].1 != "ENDTAB").copied().collect();
    (objects[start], records)
}

fn names<'a>(records: &[&'a [Pair]]) -> Vec<&'a str> {
    records.iter().map(|record| value(record, 2)).collect()
}

/// Returns the object with this handle.
fn object<'a>(pairs: &'a [Pair], handle: &str) -> &'a [Pair] {
    let objects = objects(section(pairs, "OBJECTS"));
    let found = objects.into_iter().find(|object| value(object, 5) == handle);
    found.unwrap_or_else(|| panic!("no object {handle}"))
}

/// Returns the handle under a name in a dictionary.
fn entry<'a>(dictionary: &'a [Pair], name: &str) -> &'a str {
    let place = dictionary.iter().position(|pair| pair.0 == 3 && pair.1 == name);
    let (code, handle) = &dictionary[place.unwrap_or_else(|| panic!("no {name} in {dictionary:?}")) + 1];
    assert_eq!(*code, 350);
    handle
}

#[tokio::test]
async fn sections_are_in_order_and_end_is_marked() {
    for pairs in drawings().await {
        let sections: Vec<_> =
            pairs.windows(2).filter(|two| two[0] == (0, "SECTION".into())).map(|two| two[1].1.as_str()).collect();
        assert_eq!(sections, ["HEADER", "CLASSES", "TABLES", "BLOCKS", "ENTITIES", "OBJECTS"]);
        assert_eq!(pairs.last(), Some(&(0, "EOF".into())));
    }
}

#[tokio::test]
async fn header_names_version_and_next_handle() {
    for pairs in drawings().await {
        let header = section(&pairs, "HEADER");
        let variable = |name: &str| &header[header.iter().position(|pair| pair.1 == name).unwrap() + 1];
        assert_eq!(variable("$ACADVER"), &(1, "AC1015".into()));
        let seed = u32::from_str_radix(&variable("$HANDSEED").1, 16).unwrap();
        let handles = handles(&pairs);
        assert!(handles.iter().all(|&handle| 0 < handle && handle < seed), "{seed:X}");
    }
}

/// Returns all handles: group 5, and group 105 for dimension styles. Header and classes have none.
fn handles(pairs: &[Pair]) -> Vec<u32> {
    ["TABLES", "BLOCKS", "ENTITIES", "OBJECTS"]
        .iter()
        .flat_map(|name| objects(section(pairs, name)))
        .filter(|object| !["ENDTAB"].contains(&object[0].1.as_str()))
        .map(|object| u32::from_str_radix(value(object, if object[0].1 == "DIMSTYLE" { 105 } else { 5 }), 16).unwrap())
        .collect()
}

#[tokio::test]
async fn every_object_has_unique_handle_and_existing_owner() {
    for pairs in drawings().await {
        let handles = handles(&pairs);
        let distinct: HashSet<_> = handles.iter().collect();
        assert_eq!(distinct.len(), handles.len());
        for pair in pairs.iter().filter(|pair| pair.0 == 330) {
            let owner = u32::from_str_radix(&pair.1, 16).unwrap();
            assert!(owner == 0 || distinct.contains(&owner), "no owner {owner:X}");
        }
    }
}

#[tokio::test]
async fn classes_declare_objects_beyond_autocads_own() {
    for pairs in drawings().await {
        let declared: HashMap<_, _> = objects(section(&pairs, "CLASSES"))
            .into_iter()
            .map(|class| (value(class, 1).to_owned(), value(class, 2).to_owned()))
            .collect();
        for (kind, class) in
            [("ACDBDICTIONARYWDFLT", "AcDbDictionaryWithDefault"), ("ACDBPLACEHOLDER", "AcDbPlaceHolder")]
        {
            assert_eq!(declared.get(kind).map(String::as_str), Some(class));
        }
        for object in objects(section(&pairs, "OBJECTS")) {
            assert!(object[0].1 == "DICTIONARY" || declared.contains_key(&object[0].1), "{object:?}");
        }
    }
}

#[tokio::test]
async fn has_nine_tables_with_required_records() {
    for pairs in drawings().await {
        for (name, wanted) in [
            ("VPORT", vec!["*Active"]),
            ("LTYPE", vec!["ByBlock", "ByLayer", "Continuous"]),
            ("LAYER", vec!["0"]),
            ("STYLE", vec!["Standard"]),
            ("VIEW", vec![]),
            ("UCS", vec![]),
            ("APPID", vec!["ACAD"]),
            ("DIMSTYLE", vec!["Standard"]),
            ("BLOCK_RECORD", vec!["*Model_Space", "*Paper_Space"]),
        ] {
            let (head, records) = table(&pairs, name);
            assert_eq!(value(head, 70), records.len().to_string(), "{name} counts its records");
            let names = names(&records);
            assert!(wanted.iter().all(|name| names.contains(name)), "{name} has {names:?}");
            assert_eq!(
                head.iter().filter(|pair| pair.1 == "AcDbDimStyleTable").count(),
                usize::from(name == "DIMSTYLE")
            );
            for record in records {
                assert_eq!((value(record, 330), value(record, 100)), (value(head, 5), "AcDbSymbolTableRecord"));
            }
        }
        let blocks: Vec<_> = objects(section(&pairs, "BLOCKS"));
        let names: Vec<_> = blocks.iter().filter(|block| block[0].1 == "BLOCK").map(|block| value(block, 2)).collect();
        assert_eq!(names, ["*Model_Space", "*Paper_Space"]);
    }
}

#[tokio::test]
async fn layers_have_colour_line_weight_and_plot_style() {
    for pairs in drawings().await {
        let root = objects(section(&pairs, "OBJECTS"))[0];
        assert_eq!((root[0].1.as_str(), value(root, 330)), ("DICTIONARY", "0"));
        assert_eq!(object(&pairs, entry(root, "ACAD_GROUP"))[0].1, "DICTIONARY");
        let styles = object(&pairs, entry(root, "ACAD_PLOTSTYLENAME"));
        assert_eq!(styles[0].1, "ACDBDICTIONARYWDFLT");
        let normal = entry(styles, "Normal");
        assert_eq!(value(styles, 340), normal, "it is the default");
        assert_eq!(
            (object(&pairs, normal)[0].1.as_str(), value(object(&pairs, normal), 330)),
            ("ACDBPLACEHOLDER", value(styles, 5))
        );
        let (_, layers) = table(&pairs, "LAYER");
        for layer in &layers {
            assert_eq!((value(layer, 390), value(layer, 370), value(layer, 6)), (normal, "-3", "Continuous"));
            assert!((1..=255).contains(&value(layer, 62).parse::<i32>().unwrap()));
            assert!(value(layer, 2).chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_'));
        }
        let names = names(&layers);
        for entity in objects(section(&pairs, "ENTITIES")) {
            assert!(names.contains(&value(entity, 8)), "{entity:?}");
        }
    }
}

#[tokio::test]
async fn polyline_states_vertex_count_first() {
    for pairs in drawings().await {
        for entity in objects(section(&pairs, "ENTITIES")).into_iter().filter(|entity| entity[0].1 == "LWPOLYLINE") {
            let class = entity.iter().position(|pair| pair.1 == "AcDbPolyline").unwrap();
            assert_eq!(entity[class + 1].0, 90);
            let vertices = entity.iter().filter(|pair| pair.0 == 10).count();
            assert_eq!(entity[class + 1].1, vertices.to_string());
        }
    }
}

#[tokio::test]
async fn extended_data_names_registered_application() {
    for pairs in drawings().await {
        let (_, applications) = table(&pairs, "APPID");
        let names = names(&applications);
        for pair in pairs.iter().filter(|pair| pair.0 == 1001) {
            assert!(names.contains(&pair.1.as_str()), "{pair:?}");
        }
        assert!(pairs.iter().filter(|pair| pair.0 == 1000).all(|pair| pair.1.is_ascii() && pair.1.len() <= 255));
    }
}

#[tokio::test]
async fn initial_view_holds_whole_drawing() {
    for pairs in drawings().await {
        let header = section(&pairs, "HEADER");
        let corner = header.iter().position(|pair| pair.1 == "$EXTMAX").unwrap();
        let reach_mm: f64 = header[corner + 1].1.parse().unwrap();
        let (_, views) = table(&pairs, "VPORT");
        assert_eq!((value(views[0], 12), value(views[0], 22)), ("0.0", "0.0"));
        assert!(value(views[0], 40).parse::<f64>().unwrap() > 2.0 * reach_mm);
    }
}

/// Start, end and bulge of each edge of a closed polyline.
type Arc = (Point, Point, f64);

fn arcs(pairs: &[Pair]) -> Vec<Arc> {
    let entities = objects(section(pairs, "ENTITIES"));
    let polyline = entities.into_iter().find(|entity| entity[0].1 == "LWPOLYLINE").unwrap();
    let number = |pair: &Pair| pair.1.parse::<f64>().unwrap();
    let mut corners: Vec<(Point, f64)> = Vec::new();
    for two in polyline.windows(2) {
        match (two[0].0, two[1].0) {
            (10, 20) => corners.push(((number(&two[0]), number(&two[1])), 0.0)),
            (_, 42) => corners.last_mut().unwrap().1 = number(&two[1]),
            _ => {}
        }
    }
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(&(start, bulge), &(end, _))| (start, end, bulge)).collect()
}

/// How far a point is from an arc, or from a line, whose bulge is 0.
fn distance(&((ax, ay), (bx, by), bulge): &Arc, (x, y): Point) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    let chord = dx.hypot(dy);
    let from_ends = (x - ax).hypot(y - ay).min((x - bx).hypot(y - by));
    // Along the chord and to its left, from its middle.
    let (along, left) = (
        ((x - 0.5 * (ax + bx)) * dx + (y - 0.5 * (ay + by)) * dy) / chord,
        ((y - 0.5 * (ay + by)) * dx - (x - 0.5 * (ax + bx)) * dy) / chord,
    );
    if bulge == 0.0 {
        return if along.abs() <= 0.5 * chord { left.abs() } else { from_ends };
    }
    // A counter-clockwise arc runs on the right of its chord, by its bulge times half the chord; its centre is on the left.
    let (sagitta, radius) = (0.5 * chord * bulge.abs(), 0.25 * chord * (1.0 + bulge * bulge) / bulge.abs());
    let up = -left * bulge.signum() + radius - sagitta;
    let is_beside = up > 0.0 && along.abs() * (radius - sagitta) <= 0.5 * chord * up;
    if is_beside { (along.hypot(up) - radius).abs() } else { from_ends }
}

fn farthest(arcs: &[Arc], points: impl IntoIterator<Item = Point>) -> f64 {
    let nearest = |point| arcs.iter().map(|arc| distance(arc, point)).fold(f64::INFINITY, f64::min);
    points.into_iter().map(nearest).fold(0.0, f64::max)
}

#[tokio::test]
async fn arcs_are_true_to_flank_and_cam() {
    for design in [shortest(), undercut(), bored()] {
        for tolerance_mm in [1e-2, 1e-3, 1e-5] {
            let document = with(&design, "/profile", json!({ "chord_tolerance_mm": tolerance_mm, "extent": "tooth" }));
            let number = |pointer: &str| document.pointer(pointer).unwrap().as_f64().unwrap();
            let ring = arcs(&pairs("ring", &document).await);
            let of_space = ring.len() / usize::try_from(document["drive"]["ring"]["teeth"].as_u64().unwrap()).unwrap();
            let flank = geometry(&document).await.flank(4000);
            let off_mm = farthest(&ring[..of_space], flank);
            assert!(off_mm <= tolerance_mm, "flank: {off_mm} mm, tolerance {tolerance_mm} mm");

            let (a, b) = (number("/drive/wave_generator/semi_major_mm"), number("/drive/wave_generator/semi_minor_mm"));
            let cam = arcs(&pairs("wave-generator", &document).await);
            let ellipse = (0..4000).map(|i| FRAC_PI_2 * f64::from(i) / 1000.0).map(|t| (a * t.cos(), b * t.sin()));
            let off_mm = farthest(&cam, ellipse);
            assert!(off_mm <= tolerance_mm, "cam: {off_mm} mm, tolerance {tolerance_mm} mm");
        }
    }
}

#[tokio::test]
async fn case_5_1_has_few_arcs() {
    let count = async |part: &str| arcs(&pairs(part, &shortest()).await).len();
    let (cam, ring) = (count("wave-generator").await, count("ring").await);
    assert!(cam <= 48 && ring <= 26 * 24, "{cam} and {ring} arcs");
}

#[tokio::test]
async fn an_eccentric_is_a_circle_entity() {
    let document = with(&eccentric(), "/parts", json!({ "wave_generator": { "bore_radius_mm": 10.0 } }));
    let pairs = pairs("wave-generator", &document).await;
    let circles: Vec<_> = objects(section(&pairs, "ENTITIES"))
        .into_iter()
        .map(|entity| (entity[0].1.as_str(), [10, 20, 40].map(|code| value(entity, code).parse::<f64>().unwrap())))
        .collect();
    assert_eq!(circles, [("CIRCLE", [1.2, 0.0, 30.8]), ("CIRCLE", [0.0, 0.0, 10.0])]);
}
