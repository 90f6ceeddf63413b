//! Bodies, queries and problem documents.

use axum::Json;
use axum::extract::{FromRequest, FromRequestParts, Path, Query, Request};
use axum::http::request::Parts;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use salp_protocol::problem::{self, Problem};
use serde::de::DeserializeOwned;
use tracing::error;

use crate::coordinator::CoordinatorError;
use crate::store::StoreError;

/// A request refused with a problem document.
#[derive(Debug)]
pub struct Refusal(pub Box<Problem>);

impl From<Problem> for Refusal {
    fn from(problem: Problem) -> Self {
        Self(Box::new(problem))
    }
}

impl From<StoreError> for Refusal {
    fn from(failure: StoreError) -> Self {
        error!(%failure, "the store failed");
        Problem::new(problem::INTERNAL, failure.to_string()).into()
    }
}

impl From<CoordinatorError> for Refusal {
    fn from(failure: CoordinatorError) -> Self {
        match failure {
            CoordinatorError::Store(failure) => failure.into(),
            CoordinatorError::Faults(faults) => {
                let count = faults.0.len();
                let mut problem = Problem::new(
                    problem::INVALID_STUDY,
                    format!(
                        "{count} fault{}; nothing was stored",
                        if count == 1 { "" } else { "s" }
                    ),
                );
                problem.faults = faults.0;
                problem.into()
            }
            CoordinatorError::UnknownStudy(study) => unknown_study(&study.0),
            failure @ (CoordinatorError::Machine(_)
            | CoordinatorError::Unreadable { .. }
            | CoordinatorError::Id(_)) => {
                error!(%failure, "the coordinator failed");
                Problem::new(problem::INTERNAL, failure.to_string()).into()
            }
        }
    }
}

/// There is no such study.
pub fn unknown_study(id: &str) -> Refusal {
    Problem::new(problem::UNKNOWN_STUDY, format!("there is no study {id}")).into()
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let status =
            StatusCode::from_u16(self.0.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = (status, Json(&self.0)).into_response();
        let headers = response.headers_mut();
        headers.insert(
            header::CONTENT_TYPE,
            HeaderValue::from_static(problem::MEDIA_TYPE),
        );
        match status {
            StatusCode::UNAUTHORIZED => {
                headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            }
            StatusCode::SERVICE_UNAVAILABLE => {
                headers.insert(header::RETRY_AFTER, HeaderValue::from_static("1"));
            }
            _ => {}
        }
        response
    }
}

/// The raw body, within the limit.
pub struct Body(pub Vec<u8>);

impl<S: Send + Sync> FromRequest<S> for Body {
    type Rejection = Refusal;

    async fn from_request(request: Request, state: &S) -> Result<Self, Refusal> {
        let bytes = axum::body::Bytes::from_request(request, state)
            .await
            .map_err(|rejection| {
                let kind = if rejection.status() == StatusCode::PAYLOAD_TOO_LARGE {
                    problem::TOO_LARGE
                } else {
                    problem::INVALID_BODY
                };
                Problem::new(kind, rejection.body_text())
            })?;
        Ok(Self(bytes.to_vec()))
    }
}

/// A JSON body.
pub struct JsonBody<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for JsonBody<T> {
    type Rejection = Refusal;

    async fn from_request(request: Request, state: &S) -> Result<Self, Refusal> {
        let Body(bytes) = Body::from_request(request, state).await?;
        let value = serde_json::from_slice(&bytes)
            .map_err(|fault| Problem::new(problem::INVALID_BODY, fault.to_string()))?;
        Ok(Self(value))
    }
}

/// The id of a path. One that cannot be read names nothing.
pub struct PathId<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for PathId<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refusal> {
        let Path(id) = Path::from_request_parts(parts, state)
            .await
            .map_err(|rejection| Problem::new(problem::NOT_FOUND, rejection.body_text()))?;
        Ok(Self(id))
    }
}

/// Query parameters.
pub struct Parameters<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for Parameters<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refusal> {
        let Query(value) = Query::from_request_parts(parts, state)
            .await
            .map_err(|rejection| Problem::new(problem::INVALID_QUERY, rejection.body_text()))?;
        Ok(Self(value))
    }
}

/// An answer in CSV.
pub fn csv(text: String) -> Response {
    ([(header::CONTENT_TYPE, "text/csv; charset=utf-8")], text).into_response()
}
