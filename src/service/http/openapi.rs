//! The API document for client generators, and a version in OpenAPI 3.0.3 for generators without 3.1.

use serde_json::{Map, Value, json};
use toothwave_calculation::schema_ranges::put_ranges;
use toothwave_calculation::union::put_default_kinds;

use super::problem::PROBLEM_JSON;

const SCHEMAS: &str = "/components/schemas";

/// Adds what utoipa cannot express: the server, one `Problem` for all, named variants with a discriminator, and ranges.
pub(crate) fn for_generators(document: &mut Value) {
    document["servers"] = json!([{ "url": ".", "description": "The service that serves this document." }]);
    for_each_object(document, &mut |object| {
        if let Some(media) = object.get_mut(PROBLEM_JSON) {
            *media = json!({ "schema": reference("Problem") });
        }
        remove_null(object);
    });
    default_words_beside_their_words(document);
    join_variants(document);
    name_variants(document);
    put_default_kinds(&mut document["components"]["schemas"]);
    put_ranges(document, &format!("{SCHEMAS}/Design"));
}

/// Joins a variant's schema and the schema of its tag to one object. With `additionalProperties: false`, `allOf` of the
/// two would accept nothing.
fn join_variants(document: &mut Value) {
    let Some(schemas) = document.pointer_mut(SCHEMAS).and_then(Value::as_object_mut) else { return };
    let fields = schemas.clone();
    let mut joined = Vec::new();
    for variant in schemas.values_mut().filter_map(|schema| schema.get_mut("oneOf")?.as_array_mut()).flatten() {
        let Some([own, word]) = variant.get("allOf").and_then(Value::as_array).map(Vec::as_slice) else { continue };
        let name = own.get("$ref").and_then(Value::as_str).and_then(|path| path.rsplit('/').next());
        let Some((name, object)) = name.and_then(|name| Some((name.to_owned(), fields.get(name)?))) else { continue };
        let mut object = object.clone();
        // A kind without fields has no properties.
        for (tag, schema) in word["properties"].as_object().into_iter().flatten() {
            object["properties"][tag] = schema.clone();
        }
        let required = [&word["required"], &object["required"]].into_iter().filter_map(Value::as_array).flatten();
        object["required"] = required.cloned().collect();
        *variant = object;
        joined.push(name);
    }
    let text = Value::Object(schemas.clone()).to_string();
    schemas.retain(|name, _| !joined.contains(name) || text.contains(&format!("\"#{SCHEMAS}/{name}\"")));
}

/// Fields that may be null. All others, and parameters, are absent instead.
const NULLABLE: [&str; 2] = ["tip_radius_mm", "bore_radius_mm"];

/// Removes `null` from the fields of a schema or from a parameter.
fn remove_null(object: &mut Map<String, Value>) {
    let parameter = object.contains_key("in").then(|| object.get_mut("schema")).flatten();
    parameter.into_iter().for_each(never_null);
    let fields = object.get_mut("properties").and_then(Value::as_object_mut).into_iter().flatten();
    fields.filter(|(name, _)| !NULLABLE.contains(&name.as_str())).for_each(|(_, schema)| never_null(schema));
}

fn never_null(schema: &mut Value) {
    let Some(schema) = schema.as_object_mut() else { return };
    schema.retain(|name, value| name != "default" || !value.is_null());
    for choices in ["type", "oneOf"] {
        let Some(Value::Array(kinds)) = schema.get_mut(choices) else { continue };
        kinds.retain(|kind| kind != "null" && *kind != json!({ "type": "null" }));
        let Some(only) = (kinds.len() == 1).then(|| kinds.remove(0)) else { continue };
        schema.remove(choices);
        match only {
            Value::Object(only) => schema.extend(only),
            only => schema.extend([(choices.to_owned(), only)]),
        }
    }
}

/// Moves a default word from the reference to the referenced enum. The C++ generator needs it there.
fn default_words_beside_their_words(document: &mut Value) {
    let mut moved = Vec::new();
    for_each_object(document, &mut |object| {
        if let Some(path) =
            object.get("$ref").and_then(Value::as_str).map(|path| path.trim_start_matches('#').to_owned())
            && object.get("default").is_some_and(Value::is_string)
        {
            moved.extend(object.remove("default").map(|word| (path, word)));
        }
    });
    for (path, word) in moved {
        if let Some(words) = document.pointer_mut(&path) {
            words["default"] = word;
        }
    }
}

/// Names the variants of every tagged union: each becomes a schema, and the tag becomes the discriminator.
fn name_variants(document: &mut Value) {
    let Some(schemas) = document.pointer_mut(SCHEMAS).and_then(Value::as_object_mut) else { return };
    let mut named = Map::new();
    for (name, schema) in schemas.iter_mut() {
        let Some(tag) = tag_of(schema) else { continue };
        let mut mapping = Map::new();
        for variant in schema["oneOf"].as_array_mut().into_iter().flatten() {
            let Some(word) = word_of(variant, &tag).map(str::to_owned) else { continue };
            // Unions of answers, which may get more fields, end in `Answer`.
            if !name.ends_with("Answer") {
                close(variant, &tag);
            }
            let variant_name = format!("{name}{}", capitalised(&word));
            mapping.insert(word, json!(format!("#{SCHEMAS}/{variant_name}")));
            named.insert(variant_name.clone(), std::mem::replace(variant, reference(&variant_name)));
        }
        schema["discriminator"] = json!({ "propertyName": tag, "mapping": mapping });
    }
    schemas.append(&mut named);
}

/// Forbids unknown fields, as documents do, and requires the tag first.
fn close(variant: &mut Value, tag: &str) {
    variant["additionalProperties"] = json!(false);
    let fields = variant["required"].as_array().into_iter().flatten().filter(|field| *field != tag);
    variant["required"] = [json!(tag)].iter().chain(fields).cloned().collect();
}

/// Returns the field that has one fixed word in each variant.
fn tag_of(schema: &Value) -> Option<String> {
    let variants = schema.get("oneOf")?.as_array()?;
    let is_tag = |tag: &&String| variants.iter().all(|variant| word_of(variant, tag).is_some());
    variants.first()?.get("properties")?.as_object()?.keys().find(is_tag).cloned()
}

/// Returns the only word that a field of a variant may have.
fn word_of<'a>(variant: &'a Value, tag: &str) -> Option<&'a str> {
    match variant.get("properties")?.get(tag)?.get("enum")?.as_array()?.as_slice() {
        [word] => word.as_str(),
        _ => None,
    }
}

fn capitalised(word: &str) -> String {
    word.split('_').map(|part| part[..1].to_uppercase() + &part[1..]).collect()
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#{SCHEMAS}/{name}") })
}

/// Returns the same API in OpenAPI 3.0.3, for its generators: only JSON responses, and no path without JSON.
pub(crate) fn as_3_0(document: &Value) -> Value {
    let mut document = document.clone();
    document["openapi"] = json!("3.0.3");
    if let Some(license) = document.pointer_mut("/info/license").and_then(Value::as_object_mut) {
        license.remove("identifier");
    }
    for_each_object(&mut document, &mut schema_as_3_0);
    for_each_object(&mut document, &mut |object| {
        if let Some(content) = object.get_mut("content").and_then(Value::as_object_mut)
            && content.contains_key("application/json")
        {
            content.retain(|media, _| media == "application/json");
        }
    });
    if let Some(paths) = document["paths"].as_object_mut() {
        for item in paths.values_mut().filter_map(Value::as_object_mut) {
            item.retain(|_, operation| {
                let question = operation.pointer("/requestBody/content");
                question.is_none_or(|content| content.get("application/json").is_some())
            });
        }
        paths.retain(|_, item| item.as_object().is_some_and(|item| !item.is_empty()));
    }
    document
}

/// Rewrites a schema's keywords from 3.1 to 3.0. Other objects have none of these keywords.
fn schema_as_3_0(object: &mut Map<String, Value>) {
    // A property that is named `type` has a schema, which is an object, and stays.
    if let Some(Value::Array(types)) = object.get("type").cloned() {
        let (null, others): (Vec<_>, Vec<_>) = types.into_iter().partition(|kind| kind == "null");
        if let [kind] = &others[..] {
            object.insert("type".into(), kind.clone());
        }
        if !null.is_empty() {
            object.insert("nullable".into(), json!(true));
        }
    }
    for (exclusive, inclusive) in [("exclusiveMinimum", "minimum"), ("exclusiveMaximum", "maximum")] {
        if let Some(bound) = object.get(exclusive).filter(|bound| bound.is_number()).cloned() {
            object.insert(inclusive.into(), bound);
            object.insert(exclusive.into(), json!(true));
        }
    }
    if object.get("propertyNames").is_some_and(Value::is_object) {
        object.remove("propertyNames");
    }
    // OpenAPI 3.0 ignores everything next to a reference.
    if object.len() > 1
        && let Some(target) = object.get("$ref").filter(|target| target.is_string()).cloned()
    {
        object.remove("$ref");
        object.insert("allOf".into(), json!([{ "$ref": target }]));
    }
}

/// The document as Swagger UI shows it below `/docs/`: the sweep first, and padlocks only if the service wants a key.
pub(crate) fn for_swagger(document: &Value, wants_key: bool) -> Value {
    let mut document = document.clone();
    document["servers"][0]["url"] = json!("..");
    // Groups stand in the order of the tags, paths within them in that of their names.
    if let Some(tags) = document["tags"].as_array_mut() {
        tags.insert(0, json!({ "name": "sweep", "description": "Forces and contact stresses: start here." }));
    }
    document["paths"]["/v1/sweep"]["post"]["tags"] = json!(["sweep"]);
    if !wants_key {
        for_each_object(&mut document, &mut |object| {
            object.retain(|name, _| name != "security" && name != "securitySchemes");
        });
    }
    document
}

fn for_each_object(value: &mut Value, change: &mut impl FnMut(&mut Map<String, Value>)) {
    match value {
        Value::Object(object) => {
            change(object);
            object.values_mut().for_each(|value| for_each_object(value, change));
        }
        Value::Array(values) => values.iter_mut().for_each(|value| for_each_object(value, change)),
        _ => {}
    }
}
