//! Content negotiation: media types, content codings, and the check for queries.

use std::borrow::Cow;
use std::iter;
use std::str::FromStr;

use axum::extract::Query;
use axum::http::{HeaderMap, HeaderName, Uri, header};
use headers_accept::Accept;
use mediatype::{MediaType, names};
use serde::Serialize;
use serde::de::DeserializeOwned;
use toothwave_calculation::forms::{CsvOptions, Format, Forms};

use super::problem::{Problem, ProblemCode};

/// Longest `Accept` or `Accept-Encoding` list that is read, in bytes. Browsers send some hundred bytes.
const MOST_OF_A_LIST: usize = 4096;

/// A format with its content coding. Each representation has its own entity tag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Representation {
    /// The format.
    pub format: Format,
    /// True if it is compressed.
    pub gzip: bool,
}

impl Representation {
    /// JSON, uncompressed.
    pub const JSON: Self = Self { format: Format::Json, gzip: false };

    /// Selects the best representation that the request accepts: JSON first, then `others`, in the service's order.
    /// Fails with `not_acceptable` if the client accepts none of them.
    pub fn negotiate(headers: &HeaderMap, others: impl Iterator<Item = Format>) -> Result<Self, Problem> {
        let gzip = accepts_gzip(headers);
        let accepted = joined(headers, &header::ACCEPT);
        if accepted.len() > MOST_OF_A_LIST {
            let detail = format!("the header `Accept` has {} bytes. Send at most {MOST_OF_A_LIST}", accepted.len());
            return Err(Problem::new(ProblemCode::NotAcceptable, detail));
        }
        if accepted.trim().is_empty() {
            return Ok(Self { format: Format::Json, gzip });
        }
        let formats = iter::once(Format::Json).chain(others);
        let offered: Vec<_> = formats.filter_map(|format| Some((format, media_type(format)?))).collect();
        let accept = Accept::from_str(&without_parameters(&accepted)).ok();
        let best = accept.and_then(|accept| accept.negotiate(offered.iter().map(|(_, media_type)| media_type)));
        let format = offered.iter().find(|(_, media_type)| Some(media_type) == best).map(|(format, _)| *format);
        let format = format.ok_or_else(|| {
            let offered: Vec<_> = offered.iter().map(|(_, media_type)| media_type.to_string()).collect();
            Problem::new(
                ProblemCode::NotAcceptable,
                format!("the header `Accept` allows no available media type. Accept {}", offered.join(" or ")),
            )
        })?;
        Ok(Self { format, gzip })
    }
}

/// A media type without its parameters.
fn media_type(format: Format) -> Option<MediaType<'static>> {
    MediaType::parse(format.media_type().split(';').next()?).ok()
}

/// The query of a request. A misspelled name is not ignored.
pub fn query<T: DeserializeOwned>(uri: &Uri) -> Result<T, Problem> {
    let query = Query::try_from_uri(uri).map(|Query(query)| query);
    query.map_err(|error| Problem::new(ProblemCode::InvalidQuery, error.body_text()))
}

/// The formats of an answer beside JSON. If CSV is one of them, the query may name its decimal sign.
pub fn formats<A: Forms>(uri: &Uri) -> Result<impl Iterator<Item = Format>, Problem> {
    let formats = A::FORMS.iter().map(|(format, _)| *format);
    let has_csv = formats.clone().any(|format| format == Format::Csv);
    let options: CsvOptions =
        if has_csv { query(uri)? } else { require_no_query(uri).map(|()| CsvOptions::default())? };
    Ok(formats.map(move |format| options.decimal.of(format)))
}

/// Checks that the request has no query, so that a misspelled one is not ignored.
pub fn require_no_query(uri: &Uri) -> Result<(), Problem> {
    match uri.query() {
        None | Some("") => Ok(()),
        Some(query) => {
            let detail = format!("`{}` takes no query, but the request has `{query}`. Leave it out", uri.path());
            Err(Problem::new(ProblemCode::InvalidQuery, detail))
        }
    }
}

/// Checks that the body is JSON without a content coding.
pub fn require_json(headers: &HeaderMap) -> Result<(), Problem> {
    require_type(headers, "a design document as `application/json`", |media_type| {
        media_type.subty == names::JSON || media_type.suffix == Some(names::JSON)
    })
}

/// Checks that the body is NDJSON without a content coding.
pub fn require_ndjson(headers: &HeaderMap) -> Result<(), Problem> {
    let known = ["x-ndjson", "ndjson", "jsonl", "x-jsonlines"];
    require_type(headers, "a design document a line as `application/x-ndjson`", |media_type| {
        known.iter().any(|name| media_type.subty == *name)
    })
}

/// Checks that the body has no coding and an `application/` media type that fits.
fn require_type(headers: &HeaderMap, wanted: &str, fits: impl Fn(&MediaType<'_>) -> bool) -> Result<(), Problem> {
    let unsupported =
        |found: String| Err(Problem::new(ProblemCode::UnsupportedMediaType, format!("{found}. Send {wanted}")));
    let coding = joined(headers, &header::CONTENT_ENCODING);
    if !coding.is_empty() && !coding.eq_ignore_ascii_case("identity") {
        return unsupported(format!("the body has the content coding `{coding}`, and no coding is supported"));
    }
    let coding = joined(headers, &header::TRANSFER_ENCODING);
    if !coding.is_empty() && !coding.eq_ignore_ascii_case("chunked") {
        return unsupported(format!("the body has the transfer coding `{coding}`, and only `chunked` is supported"));
    }
    let content_type = joined(headers, &header::CONTENT_TYPE);
    if MediaType::parse(&content_type).is_ok_and(|media_type| media_type.ty == names::APPLICATION && fits(&media_type))
    {
        Ok(())
    } else if content_type.is_empty() {
        unsupported("the request has no `Content-Type`".into())
    } else {
        unsupported(format!("the body has the media type `{content_type}`"))
    }
}

/// Returns the valid media ranges with their weights alone. `application/json; charset=utf-8` accepts plain JSON, and
/// older clients list `*` next to `*/*`. No offered type has a parameter with a quoted `,` or `;`.
fn without_parameters(accepted: &str) -> String {
    let ranges = accepted.split(',').map(|range| {
        let (media_type, parameters) = range.split_once(';').unwrap_or((range, ""));
        let weight =
            parameters.split(';').find(|parameter| parameter.trim_start().to_ascii_lowercase().starts_with("q="));
        weight.map_or_else(|| media_type.to_owned(), |weight| format!("{media_type};{}", weight.trim()))
    });
    ranges.filter(|range| MediaType::parse(range.trim()).is_ok()).collect::<Vec<_>>().join(",")
}

/// True if the request prefers gzip to no coding.
pub fn accepts_gzip(headers: &HeaderMap) -> bool {
    let accepted = joined(headers, &header::ACCEPT_ENCODING);
    if accepted.len() > MOST_OF_A_LIST {
        return false;
    }
    let quality = |coding: &str| {
        accepted.split(',').find_map(|item| {
            let mut parts = item.split(';').map(str::trim);
            let is_meant = parts.next().is_some_and(|name| name.eq_ignore_ascii_case(coding));
            let weight = parts.find_map(|parameter| {
                let (name, value) = parameter.split_once('=')?;
                name.trim().eq_ignore_ascii_case("q").then_some(value.trim())
            });
            is_meant.then(|| weight.map_or(1.0, |weight| weight.parse().unwrap_or(0.0)))
        })
    };
    let gzip = quality("gzip").or_else(|| quality("x-gzip")).or_else(|| quality("*")).unwrap_or(0.0);
    gzip > 0.0 && gzip >= quality("identity").unwrap_or(0.0)
}

/// Joins all lines of a header to one list. A value that is not text counts as absent.
fn joined<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Cow<'a, str> {
    let mut values = headers.get_all(name).iter().filter_map(|value| value.to_str().ok());
    let first = values.next().unwrap_or_default();
    values.fold(first.into(), |list, value| format!("{list},{value}").into())
}

/// True if `If-None-Match` contains this entity tag (weak comparison, RFC 9110). `*` is ignored: it serves writes, and
/// a client without an answer would get none.
pub fn is_not_modified(headers: &HeaderMap, etag: &str) -> bool {
    let listed = joined(headers, &header::IF_NONE_MATCH);
    listed.split(',').map(str::trim).any(|tag| tag.strip_prefix("W/").unwrap_or(tag) == etag)
}
