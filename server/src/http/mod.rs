//! The API (v1).

mod answer;
mod events;
mod health;
mod results;
mod studies;
mod work;

use std::net::IpAddr;
use std::sync::Arc;

use axum::Router;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post, put};
use salp_protocol::problem::{self, Problem};

use crate::coordinator::Coordinator;
use answer::Refusal;

/// Results carry gradients of many constraints, bytes.
const LARGEST_RESULT: usize = 256 << 20;

/// What every handler gets.
type Shared = State<Arc<Coordinator>>;

/// All paths.
pub fn router(coordinator: Arc<Coordinator>) -> Router {
    let limit = coordinator.config.body_limit;
    let api = Router::new()
        .route("/v1/studies", post(studies::submit).get(studies::list))
        .route("/v1/studies/{id}", get(studies::show))
        .route("/v1/studies/{id}/document", get(studies::document))
        .route("/v1/studies/{id}/cancel", post(studies::cancel))
        .route("/v1/studies/{id}/pause", post(studies::pause))
        .route("/v1/studies/{id}/resume", post(studies::resume))
        .route("/v1/studies/{id}/restarts", get(results::restarts))
        .route(
            "/v1/studies/{id}/steps/{step}/restarts/{index}/resume",
            post(results::resume_restart),
        )
        .route("/v1/studies/{id}/curve", get(results::curve))
        .route("/v1/studies/{id}/evaluations", get(results::evaluations))
        .route("/v1/studies/{id}/candidates", get(results::candidates))
        .route("/v1/studies/{id}/events", get(events::events))
        .route("/v1/claims", post(work::claim))
        .route("/v1/evaluations/{id}/heartbeat", put(work::heartbeat))
        .route(
            "/v1/evaluations/{id}/result",
            put(work::result).layer(DefaultBodyLimit::max(limit.max(LARGEST_RESULT))),
        )
        .route("/v1/evaluations/{id}/release", put(work::release))
        .route("/v1/workers", get(work::list))
        .route("/v1/workers/{id}/drain", post(work::drain))
        .layer(middleware::from_fn_with_state(
            Arc::clone(&coordinator),
            need_token,
        ));
    Router::new()
        .route("/livez", get(health::live))
        .route("/readyz", get(health::ready))
        .merge(api)
        .fallback(unknown_path)
        .method_not_allowed_fallback(unknown_method)
        .layer(DefaultBodyLimit::max(limit))
        .with_state(coordinator)
}

/// Lets a request pass that carries the token, where there is one.
async fn need_token(
    State(coordinator): Shared,
    request: Request,
    next: Next,
) -> Result<Response, Refusal> {
    if let Some(token) = &coordinator.config.token {
        let offered = request
            .headers()
            .get(header::AUTHORIZATION)
            .and_then(|value| value.to_str().ok())
            .and_then(|value| value.strip_prefix("Bearer "));
        if !offered.is_some_and(|offered| token.matches(offered)) {
            return Err(Problem::new(
                problem::UNAUTHORISED,
                "send the token as `Authorization: Bearer <token>`",
            )
            .into());
        }
    } else if !comes_from_here(&request) {
        return Err(Problem::new(
            problem::FOREIGN_ORIGIN,
            "a coordinator without a token answers programs and pages of this machine only",
        )
        .into());
    }
    Ok(next.run(request).await)
}

/// Without a token, loopback is all the protection there is, and a browser lends it to every page: a page of another
/// site shows itself by its origin, one that points its own name at 127.0.0.1 by the host it asks for.
fn comes_from_here(request: &Request) -> bool {
    let text = |name| {
        request
            .headers()
            .get(name)
            .map(|value| value.to_str().unwrap_or("?"))
    };
    let is_loopback = |authority: &str| {
        let name = match authority.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
            _ => authority,
        };
        let address = name.trim_start_matches('[').trim_end_matches(']');
        name.eq_ignore_ascii_case("localhost")
            || address.parse().is_ok_and(|ip: IpAddr| ip.is_loopback())
    };
    let host = text(header::HOST);
    let origin = text(header::ORIGIN);
    host.is_none_or(is_loopback)
        && origin.is_none_or(|origin| {
            host.is_some_and(|host| origin.strip_prefix("http://") == Some(host))
        })
}

async fn unknown_path(request: Request) -> Refusal {
    Problem::new(
        problem::NOT_FOUND,
        format!("there is nothing at {}", request.uri().path()),
    )
    .into()
}

async fn unknown_method(request: Request) -> Refusal {
    Problem::new(
        problem::METHOD_NOT_ALLOWED,
        format!(
            "{} is not known at {}",
            request.method(),
            request.uri().path()
        ),
    )
    .into()
}

/// 204, no body.
fn nothing() -> Response {
    StatusCode::NO_CONTENT.into_response()
}
