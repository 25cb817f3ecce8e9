//! The routes, and the middleware around them.

use std::net::IpAddr;
use std::sync::{Arc, LazyLock};

use axum::Router;
use axum::extract::Request;
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde_json::Value;
use tower::ServiceBuilder;
use tower::util::option_layer;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::cors::{AllowHeaders, AllowOrigin, Any, CorsLayer};
use utoipa::openapi::security::{Http, HttpAuthScheme, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{self, Content, HeaderBuilder, Ref, RefOr, ResponseBuilder};
use utoipa::{OpenApi, PartialSchema};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::answer::{CACHE_STATUS, SERVER_TIMING};
use super::docs;
use super::endpoints::{batch, calculations, design, drawings, service, studies};
use super::negotiation::require_no_query;
use super::observe;
use super::problem::{PROBLEM_JSON, Problem, ProblemCode};
use crate::app::App;
use crate::ops::keys::{self, Keys};
use crate::page;
use crate::page::static_file::StaticFile;

#[derive(OpenApi)]
#[openapi(
    info(
        title = "toothwave",
        description = "Forces and contact stresses of discrete-tooth harmonic drives. The name of a number ends in its unit. The value and the limit of a finding or a problem have a separate unit field.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    tags(
        (name = "drive", description = "Calculations. Every endpoint reads the same design document."),
        (name = "studies", description = "Many variants of one design: map, search, sensitivity, tolerance study."),
        (name = "service", description = "Limits, examples, materials, health and metrics.")
    )
)]
struct Document;

/// Routes with their descriptions. They are made once, because that takes long.
static API: LazyLock<(Router<Arc<App>>, openapi::OpenApi)> = LazyLock::new(|| api().split_for_parts());

fn api() -> OpenApiRouter<Arc<App>> {
    let without_document = OpenApiRouter::new()
        .routes(routes!(service::limits))
        .routes(routes!(service::examples))
        .routes(routes!(service::materials))
        .routes(routes!(service::example))
        .routes(routes!(service::live))
        .routes(routes!(service::ready))
        .routes(routes!(service::metrics))
        .routes(routes!(studies::quantities))
        .routes(routes!(studies::study, studies::cancel))
        .routes(routes!(studies::events));
    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(calculations::geometry))
        .routes(routes!(calculations::coincidence_degree))
        .routes(routes!(calculations::sweep))
        .routes(routes!(design::design))
        .routes(routes!(calculations::accuracy))
        .routes(routes!(drawings::drawing))
        .routes(routes!(batch::batch))
        .routes(routes!(studies::begin))
        .routes(routes!(studies::result))
        // These read their query, or refuse one, themselves.
        .merge(without_document.layer(middleware::from_fn(without_query)))
}

/// Access rules of the service.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// Origins that browsers may call from.
    pub cors_origins: Vec<String>,
    /// The keys, if requests need one.
    pub keys: Option<Keys>,
    /// True if requests must use a loopback host name.
    pub checks_host: bool,
}

/// Returns the API document.
pub fn openapi_json() -> String {
    pretty(&DOCUMENT)
}

/// Returns the API document in OpenAPI 3.0.3.
pub fn openapi_3_0_json() -> String {
    pretty(&super::openapi::as_3_0(&DOCUMENT))
}

static DOCUMENT: LazyLock<Value> = LazyLock::new(document);

fn document() -> Value {
    let mut document = API.1.clone();
    describe_entry(&mut document);
    let mut document = serde_json::to_value(document).unwrap_or_default();
    super::openapi::for_generators(&mut document);
    document
}

fn pretty(document: &Value) -> String {
    let mut text = serde_json::to_string_pretty(document).unwrap_or_default();
    text.push('\n');
    text
}

/// Headers of cacheable responses.
const ANSWER_HEADERS: [(&str, &str); 3] = [
    ("ETag", "Entity tag of this representation."),
    ("Cache-Status", "RFC 9211: `hit`, `fwd=miss`, `collapsed`."),
    ("Server-Timing", "`solve;dur=` and the milliseconds of the computation."),
];

/// Adds the responses of the middleware to every path: unknown query, missing key, wrong host, too many connections.
fn describe_entry(document: &mut openapi::OpenApi) {
    const KEY: &str = "key";
    let mut scheme = Http::new(HttpAuthScheme::Bearer);
    scheme.description = Some("A key from the keys file. A service without a keys file needs no key.".into());
    document.components.get_or_insert_default().add_security_scheme(KEY, SecurityScheme::Http(scheme));
    let problem = |description: &str| {
        let content = Content::new(Some(Ref::from_schema_name("Problem")));
        ResponseBuilder::new().description(description).content(PROBLEM_JSON, content)
    };
    let query = problem("The query is unknown or invalid.").build();
    let host = problem("The service listens on the loopback address, and the request has another host name.").build();
    let wanted = problem("The key is missing or unknown.").build();
    let seconds = HeaderBuilder::new().schema(Some(u32::schema())).description(Some("Seconds")).build();
    let full = problem("The limit of open connections is reached.").header("Retry-After", seconds).build();
    for (path, item) in &mut document.paths.paths {
        for operation in [&mut item.get, &mut item.post, &mut item.delete].into_iter().flatten() {
            let responses = &mut operation.responses.responses;
            if !path.starts_with("/health/") {
                // A key or no key.
                operation.security =
                    Some(vec![SecurityRequirement::default(), SecurityRequirement::new::<_, _, String>(KEY, [])]);
                responses.insert("401".into(), wanted.clone().into());
            }
            responses.entry("400".into()).or_insert_with(|| query.clone().into());
            // A response that can be 304 has an entity tag and a cache status.
            if responses.contains_key("304")
                && let Some(RefOr::T(answer)) = responses.get_mut("200")
            {
                answer.headers.extend(ANSWER_HEADERS.map(|(name, text)| {
                    let header = HeaderBuilder::new().schema(Some(String::schema())).description(Some(text)).build();
                    (name.into(), header.into())
                }));
            }
            responses.insert("421".into(), host.clone().into());
            responses.entry("503".into()).or_insert_with(|| full.clone().into());
        }
    }
}

/// Makes the router of the whole service.
pub fn router(app: Arc<App>, access: &Access) -> Router {
    let wants_key = access.keys.is_some();
    let paths = API
        .0
        .clone()
        .route("/", get(page::index))
        .route("/page/{*name}", get(page::asset))
        .route("/openapi.json", get(|headers| api_file(0, headers)))
        .route("/openapi-3.0.json", get(|headers| api_file(1, headers)))
        .route("/docs/openapi.json", get(move |headers| api_file(2 + usize::from(wants_key), headers)))
        .route("/docs", get(docs::redirect))
        .route("/docs/", get(docs::index))
        .route("/docs/{*name}", get(docs::asset))
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed);
    with_layers(paths, app, access)
}

fn with_layers(paths: Router<Arc<App>>, app: Arc<App>, access: &Access) -> Router {
    let Access { cors_origins, keys, checks_host } = access;
    paths
        .layer(
            // From the outside in, as one stack: every layer of a router boxes all routes again. The inner
            // CatchPanicLayer makes a panic a problem before it is counted and logged. The outer one catches panics of
            // the middleware itself. A refused request still gets headers and a log line.
            ServiceBuilder::new()
                .layer(CatchPanicLayer::custom(panicked))
                .layer(middleware::from_fn_with_state(Arc::clone(&app), observe::observe))
                .layer(option_layer((!cors_origins.is_empty()).then(|| cors(cors_origins))))
                .layer(CatchPanicLayer::custom(panicked))
                .layer(option_layer(checks_host.then(|| middleware::from_fn(require_host_of_this_machine))))
                .layer(option_layer(keys.clone().map(|keys| middleware::from_fn_with_state(keys, keys::require)))),
        )
        .with_state(app)
}

/// Refuses requests with a host name that is not this machine, against DNS rebinding. Another site can point its name
/// to this address, but cannot change the `Host` that the browser sends.
async fn require_host_of_this_machine(request: Request, next: Next) -> Response {
    let mut hosts = request.headers().get_all(header::HOST).iter();
    let of_header = || hosts.next()?.to_str().ok()?.parse::<Authority>().ok().filter(|_| hosts.next().is_none());
    let host = request.uri().authority().cloned().or_else(of_header);
    // Browsers always send a host.
    let is_absent = host.is_none() && !request.headers().contains_key(header::HOST);
    let is_of_this_machine = |host: Authority| {
        let port = host.as_str().strip_prefix(host.host());
        let is_port =
            |port: &str| port.strip_prefix(':').is_some_and(|port| port.bytes().all(|byte| byte.is_ascii_digit()));
        let name = host.host().trim_start_matches('[').trim_end_matches(']');
        port.is_some_and(|port| port.is_empty() || is_port(port))
            && (name.eq_ignore_ascii_case("localhost")
                || name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback()))
    };
    if is_absent || host.is_some_and(is_of_this_machine) {
        return next.run(request).await;
    }
    let detail = "the service listens on the loopback address alone. Use `localhost` or this address as the host name";
    Problem::new(ProblemCode::MisdirectedRequest, detail).into_response()
}

/// The middleware of paths without a query.
async fn without_query(request: Request, next: Next) -> Response {
    match require_no_query(request.uri()) {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

/// The API document, its rendering in OpenAPI 3.0, and what Swagger UI shows without and with keys.
static API_FILES: LazyLock<[StaticFile; 4]> = LazyLock::new(|| {
    let for_swagger = |wants_key| pretty(&super::openapi::for_swagger(&DOCUMENT, wants_key));
    [openapi_json(), openapi_3_0_json(), for_swagger(false), for_swagger(true)]
        .map(|text| StaticFile::new("application/json", text))
});

async fn api_file(index: usize, headers: HeaderMap) -> Response {
    API_FILES[index].answer(&headers)
}

async fn not_found(request: Request) -> Problem {
    let detail = format!("there is no path `{}`. `/docs` lists the paths", request.uri().path());
    Problem::new(ProblemCode::NotFound, detail)
}

async fn method_not_allowed(request: Request) -> Problem {
    let detail = format!(
        "`{}` does not support {}. The header `Allow` lists the supported methods",
        request.uri().path(),
        request.method()
    );
    Problem::new(ProblemCode::MethodNotAllowed, detail)
}

fn panicked(panic: Box<dyn std::any::Any + Send>) -> Response {
    Problem::panicked(panic.as_ref()).into_response()
}

fn cors(origins: &[String]) -> CorsLayer {
    let allowed = if origins.iter().any(|origin| origin == "*") {
        AllowOrigin::any()
    } else {
        // A browser cannot send an origin that is not a header value.
        AllowOrigin::list(origins.iter().filter_map(|origin| HeaderValue::from_str(origin).ok()))
    };
    CorsLayer::new()
        .allow_origin(allowed)
        .allow_methods(Any)
        .allow_headers(AllowHeaders::mirror_request())
        .expose_headers([
            header::ETAG,
            header::LOCATION,
            header::RETRY_AFTER,
            CACHE_STATUS,
            studies::PREFERENCE_APPLIED,
            SERVER_TIMING,
            observe::X_REQUEST_ID,
        ])
}
