//! All paths on one screen, and the layers around them in order.

use std::net::IpAddr;
use std::sync::{Arc, LazyLock};

use axum::Router;
use axum::extract::Request;
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
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
use utoipa_swagger_ui::{Config, SwaggerUi};

use super::answer::{CACHE_STATUS, SERVER_TIMING};
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
        description = "Forces and contact stresses of discrete-tooth harmonic drives. Names of numbers end in their unit; where a finding or a problem has a value and a limit, the unit stands beside them.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    tags(
        (name = "drive", description = "One design document for every endpoint."),
        (name = "studies", description = "Many variants of one design: maps, searches, sensitivities, tolerances."),
        (name = "service", description = "Beside the drive.")
    )
)]
struct Document;

/// Paths with their description, made once: it takes long, and is the same for every router of the process.
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

/// Who may use the service.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// Origins that browsers may call from.
    pub cors_origins: Vec<String>,
    /// The keys, if requests need one.
    pub keys: Option<Keys>,
    /// Whether requests must name this machine as their host.
    pub checks_host: bool,
}

/// The API document as it is committed and served.
pub fn openapi_json() -> &'static str {
    static JSON: LazyLock<String> = LazyLock::new(|| pretty(&DOCUMENT));
    &JSON
}

/// The same in OpenAPI 3.0.3.
pub fn openapi_3_0_json() -> &'static str {
    static JSON: LazyLock<String> = LazyLock::new(|| pretty(&super::openapi::as_3_0(&DOCUMENT)));
    &JSON
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

/// The headers of answers that clients and the service may cache.
const ANSWER_HEADERS: [(&str, &str); 3] = [
    ("ETag", "Entity tag of this representation."),
    ("Cache-Status", "RFC 9211: `hit`, `fwd=miss`, `collapsed`."),
    ("Server-Timing", "`solve;dur=` and the milliseconds of the solve."),
];

/// Describes what every path can answer before its handler runs: an unknown query, a missing key, another host, too many connections.
fn describe_entry(document: &mut openapi::OpenApi) {
    const KEY: &str = "key";
    let mut scheme = Http::new(HttpAuthScheme::Bearer);
    scheme.description = Some("A key from the keys file, where the service has one; else none is wanted.".into());
    document.components.get_or_insert_default().add_security_scheme(KEY, SecurityScheme::Http(scheme));
    let problem = |description: &str| {
        let content = Content::new(Some(Ref::from_schema_name("Problem")));
        ResponseBuilder::new().description(description).content(PROBLEM_JSON, content)
    };
    let query = problem("A query that the path does not know.").build();
    let host = problem("The service listens on this machine alone, and the host is another name.").build();
    let wanted = problem("A key is wanted, and the request has none or one that opens nothing.").build();
    let seconds = HeaderBuilder::new().schema(Some(u32::schema())).description(Some("Seconds")).build();
    let full = problem("As many connections are open as the service admits.").header("Retry-After", seconds).build();
    for (path, item) in &mut document.paths.paths {
        for operation in [&mut item.get, &mut item.post, &mut item.delete].into_iter().flatten() {
            let responses = &mut operation.responses.responses;
            if !path.starts_with("/health/") {
                // Either a key or none.
                operation.security =
                    Some(vec![SecurityRequirement::default(), SecurityRequirement::new::<_, _, String>(KEY, [])]);
                responses.insert("401".into(), wanted.clone().into());
            }
            responses.entry("400".into()).or_insert_with(|| query.clone().into());
            // An answer that can be 304 has an entity tag, and comes from the cache or a computation.
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

/// The whole service.
pub fn router(app: Arc<App>, access: &Access) -> Router {
    // The bundled page alone: without "none" it would ask a validator elsewhere.
    let config = Config::new(["openapi.json"]).validator_url("none");
    let wants_key = access.keys.is_some();
    let docs: Router<Arc<App>> = SwaggerUi::new("/docs").config(config).into();
    let docs = docs.layer(middleware::map_response(as_documentation));
    let paths = API
        .0
        .clone()
        .route("/", get(page::index))
        .route("/page/{*name}", get(page::asset))
        .route("/openapi.json", get(|headers| api_file(0, headers)))
        .route("/openapi-3.0.json", get(|headers| api_file(1, headers)))
        .route("/docs/openapi.json", get(move |headers| api_file(2 + usize::from(wants_key), headers)))
        .merge(docs)
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed);
    with_layers(paths, app, access)
}

fn with_layers(paths: Router<Arc<App>>, app: Arc<App>, Access { cors_origins, keys, checks_host }: &Access) -> Router {
    // Who is not let in by the keys still gets what the layers around give; where there are none, nothing is asked.
    let paths = match keys {
        Some(keys) => paths.layer(middleware::from_fn_with_state(keys.clone(), keys::require)),
        None => paths,
    };
    let paths = if *checks_host { paths.layer(middleware::from_fn(require_host_of_this_machine)) } else { paths };
    paths
        .layer(
            // From the outside in; one stack, because every layer of a router boxes all its routes once more. A panic becomes a problem
            // before it is counted, logged and given its headers; one of the counting itself is catch_panic too.
            ServiceBuilder::new()
                .layer(CatchPanicLayer::custom(panicked))
                .layer(middleware::from_fn_with_state(Arc::clone(&app), observe::observe))
                .layer(option_layer((!cors_origins.is_empty()).then(|| cors(cors_origins))))
                .layer(CatchPanicLayer::custom(panicked)),
        )
        .with_state(app)
}

/// A page of another site can have its own name resolve to this machine, and would then be of the same origin as the service. It cannot
/// change the `Host` that the browser sends.
async fn require_host_of_this_machine(request: Request, next: Next) -> Response {
    let mut hosts = request.headers().get_all(header::HOST).iter();
    let of_header = || hosts.next()?.to_str().ok()?.parse::<Authority>().ok().filter(|_| hosts.next().is_none());
    let host = request.uri().authority().cloned().or_else(of_header);
    // Without any it is no browser.
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
    let detail = "the service listens on this machine alone: call it `localhost`, or by its address";
    Problem::new(ProblemCode::MisdirectedRequest, detail).into_response()
}

/// The middleware of paths that know no query.
async fn without_query(request: Request, next: Next) -> Response {
    match require_no_query(request.uri()) {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

/// The API document, its rendering in OpenAPI 3.0, and what Swagger UI shows without and with keys.
static API_FILES: LazyLock<[StaticFile; 4]> = LazyLock::new(|| {
    let for_swagger = |wants_key| pretty(&super::openapi::for_swagger(&DOCUMENT, wants_key));
    [openapi_json().into(), openapi_3_0_json().into(), for_swagger(false), for_swagger(true)]
        .map(|text: String| StaticFile::new("application/json", text.into_bytes()))
});

async fn api_file(index: usize, headers: HeaderMap) -> Response {
    API_FILES[index].answer(&headers)
}

async fn not_found(request: Request) -> Problem {
    let detail = format!("nothing stands at `{}`; `/docs` lists the paths", request.uri().path());
    Problem::new(ProblemCode::NotFound, detail)
}

/// Swagger UI styles its elements itself and draws with data URLs.
const DOCS_POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'",
);

/// The documentation's pages say 404 in words of their own, of names that are no text 400, and no policy.
async fn as_documentation(mut response: Response) -> Response {
    if matches!(response.status(), StatusCode::NOT_FOUND | StatusCode::BAD_REQUEST) {
        return Problem::new(ProblemCode::NotFound, "the documentation has no such page").into_response();
    }
    if response.status().is_redirection() {
        // From `/docs`, and relative, because a proxy may strip a prefix from the path.
        response.headers_mut().insert(header::LOCATION, HeaderValue::from_static("docs/"));
    }
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, DOCS_POLICY);
    response
}

async fn method_not_allowed(request: Request) -> Problem {
    let detail = format!("`{}` does not know {}; `Allow` lists what it knows", request.uri().path(), request.method());
    Problem::new(ProblemCode::MethodNotAllowed, detail)
}

fn panicked(panic: Box<dyn std::any::Any + Send>) -> Response {
    Problem::panicked(panic.as_ref()).into_response()
}

fn cors(origins: &[String]) -> CorsLayer {
    let allowed = if origins.iter().any(|origin| origin == "*") {
        AllowOrigin::any()
    } else {
        // An origin that is no header value could never be sent by a browser either.
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
