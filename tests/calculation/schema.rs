//! Random documents made from the schema of the design document.

use std::sync::LazyLock;

use serde_json::{Value, json};

/// The schemas of the API document.
pub(crate) struct Schemas(&'static Value);

impl Schemas {
    pub(crate) fn new() -> Self {
        static DOCUMENT: LazyLock<Value> =
            LazyLock::new(|| serde_json::from_str(include_str!("../../openapi/openapi.json")).unwrap());
        Self(&DOCUMENT["components"]["schemas"])
    }

    /// Returns a document with all required fields and a random choice of optional ones.
    pub(crate) fn document(&self, chance: &mut Chance) -> Value {
        self.value(&self.0["Design"], chance)
    }

    fn value(&self, schema: &Value, chance: &mut Chance) -> Value {
        if let Some(name) = schema["$ref"].as_str().and_then(|reference| reference.rsplit('/').next()) {
            return self.value(&self.0[name], chance);
        }
        for alternatives in ["oneOf", "anyOf"] {
            if let Some(alternatives) = schema[alternatives].as_array() {
                return self.value(&alternatives[chance.below(alternatives.len())], chance);
            }
        }
        if let Some(words) = schema["enum"].as_array() {
            return words[chance.below(words.len())].clone();
        }
        let kind = match &schema["type"] {
            Value::Array(kinds) => &kinds[chance.below(kinds.len())],
            kind => kind,
        };
        match kind.as_str().unwrap() {
            "object" => {
                let required = schema["required"].as_array().cloned().unwrap_or_default();
                let fields = schema["properties"].as_object().into_iter().flatten();
                let chosen = fields.filter(|(name, _)| required.contains(&json!(name)) || chance.below(3) > 0);
                let chosen: Vec<_> = chosen.collect();
                chosen.into_iter().map(|(name, schema)| (name.clone(), self.value(schema, chance))).collect()
            }
            "array" => (0..chance.below(4)).map(|_| self.value(&schema["items"], chance)).collect(),
            "number" => json!(number(schema, chance)),
            "integer" => json!(number(schema, chance).floor()),
            "boolean" => json!(chance.below(2) == 0),
            "null" => Value::Null,
            other => panic!("{other}: {schema}"),
        }
    }
}

/// Returns an ordinary number, or sometimes an end of the range.
fn number(schema: &Value, chance: &mut Chance) -> f64 {
    let bound = |closed: &str, open: &str| {
        schema[closed].as_f64().unwrap_or_else(|| schema[open].as_f64().unwrap_or_else(|| panic!("no range: {schema}")))
    };
    let (low, high) = (bound("minimum", "exclusiveMinimum"), bound("maximum", "exclusiveMaximum"));
    match chance.below(8) {
        0 => low,
        1 => high,
        2..5 => (low + (high.min(100.0) - low) * chance.share()).clamp(low, high),
        _ => low + (high - low) * chance.share(),
    }
}

/// A reproducible random generator (Marsaglia's xorshift).
pub(crate) struct Chance(u64);

impl Chance {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        usize::try_from((self.next() >> 11) % count as u64).unwrap()
    }

    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Returns pointers to all leaves of a document.
pub(crate) fn leaves(value: &Value, at: &str) -> Vec<String> {
    let below = |(name, value): (String, &Value)| leaves(value, &format!("{at}/{name}"));
    match value {
        Value::Object(fields) => fields.iter().map(|(name, value)| (name.clone(), value)).flat_map(below).collect(),
        Value::Array(items) => {
            items.iter().enumerate().map(|(index, item)| (index.to_string(), item)).flat_map(below).collect()
        }
        _ => vec![at.into()],
    }
}

/// Returns pointers to all objects.
pub(crate) fn objects(value: &Value, at: &str) -> Vec<String> {
    let Some(fields) = value.as_object() else { return Vec::new() };
    let below = fields.iter().flat_map(|(name, value)| objects(value, &format!("{at}/{name}")));
    std::iter::once(at.to_owned()).chain(below).collect()
}
