//! Events: a stream that can be taken up again, and a long poll beside it.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::sse::{self, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::stream::{self, Stream};
use salp_protocol::{Event, EventPage, StudyId};
use serde::Deserialize;
use tokio::time::Instant;

use super::Shared;
use super::answer::{Parameters, PathId, Refusal};
use super::studies::find;
use crate::coordinator::{Coordinator, LONGEST_WAIT_S};

/// Events of one answer or one look at the store.
const PAGE: i64 = 1000;
/// How often a stream looks although nothing was announced: another coordinator may have written.
const LOOK_AGAIN: Duration = Duration::from_secs(5);

/// Parameters of events.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EventParameters {
    after: Option<i64>,
    wait: Option<f64>,
}

/// A stream (SSE); with `?wait=` seconds a long poll that answers one page.
pub async fn events(
    State(coordinator): Shared,
    PathId(id): PathId<String>,
    Parameters(parameters): Parameters<EventParameters>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let study = find(&coordinator, id).await?.id;
    let last_seen = headers
        .get("last-event-id")
        .and_then(|value| value.to_str().ok())
        .and_then(|value| value.trim().parse().ok());
    let after = last_seen.or(parameters.after).unwrap_or(0);
    match parameters.wait {
        Some(wait) => {
            let events = poll(&coordinator, &study, after, wait).await?;
            Ok(Json(EventPage { events }).into_response())
        }
        None => Ok(Sse::new(follow(coordinator, study, after))
            .keep_alive(KeepAlive::default())
            .into_response()),
    }
}

async fn poll(
    coordinator: &Arc<Coordinator>,
    study: &StudyId,
    after: i64,
    wait: f64,
) -> Result<Vec<Event>, Refusal> {
    let wait = if wait.is_finite() {
        wait.clamp(0.0, LONGEST_WAIT_S)
    } else {
        0.0
    };
    let until = Instant::now() + Duration::from_secs_f64(wait);
    let mut news = coordinator.news();
    let mut stopping = coordinator.stopping();
    loop {
        news.borrow_and_update();
        let events = coordinator.store.events(study, after, PAGE).await?;
        let left = until.saturating_duration_since(Instant::now());
        if !events.is_empty() || left.is_zero() || *stopping.borrow() {
            return Ok(events);
        }
        tokio::select! {
            _ = news.changed() => {}
            _ = stopping.changed() => {}
            () = tokio::time::sleep(left.min(LOOK_AGAIN)) => {}
        }
    }
}

/// Ends when the study has ended and everything was sent, when the store fails (the client takes it up again), or when
/// the coordinator goes down.
fn follow(
    coordinator: Arc<Coordinator>,
    study: StudyId,
    after: i64,
) -> impl Stream<Item = Result<sse::Event, Infallible>> {
    let start = (coordinator, study, after, VecDeque::<Event>::new());
    stream::unfold(
        start,
        |(coordinator, study, mut after, mut queue)| async move {
            while queue.is_empty() {
                let ended = match coordinator.store.study(&study).await {
                    Ok(Some(stored)) => stored.state.is_final(),
                    _ => return None,
                };
                let events = poll(&coordinator, &study, after, if ended { 0.0 } else { 5.0 })
                    .await
                    .ok()?;
                if events.is_empty() && (ended || *coordinator.stopping().borrow()) {
                    return None;
                }
                queue.extend(events);
            }
            let event = queue.pop_front()?;
            after = event.id;
            let sent = sse::Event::default()
                .id(event.id.to_string())
                .event(&event.kind)
                .data(event.data.to_string());
            Some((Ok(sent), (coordinator, study, after, queue)))
        },
    )
}
