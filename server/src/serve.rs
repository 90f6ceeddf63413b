//! Starting and stopping the coordinator.

use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::sync::watch;
use tracing::info;

use crate::config::ServerConfig;
use crate::coordinator::Coordinator;
use crate::http;
use crate::store::{Store, StoreError};

/// How long requests under way may take once the coordinator goes down.
const GRACE: Duration = Duration::from_secs(10);

/// Why the coordinator did not start, or ended.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address cannot be had.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
    /// The store failed at the start.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The listener failed.
    #[error("the listener failed: {0}")]
    Listener(std::io::Error),
}

/// Serves until `shutdown` resolves; then held claims and event streams are answered at once, and what is under way is
/// finished. `bound` is told the address once requests are taken.
///
/// # Errors
/// [`ServeError`] where the address or the store cannot be had.
pub async fn serve(
    config: ServerConfig,
    store: Arc<dyn Store>,
    bound: impl FnOnce(SocketAddr),
    shutdown: impl Future<Output = ()> + Send + 'static,
) -> Result<(), ServeError> {
    let address = config.listen;
    let listen = |source| ServeError::Listen { address, source };
    let listener = TcpListener::bind(address).await.map_err(listen)?;
    let local = listener.local_addr().map_err(listen)?;
    let (stop, stopping) = watch::channel(false);
    let coordinator = Coordinator::new(config, store, stopping.clone());
    coordinator.recover().await?;
    let app = http::router(coordinator);
    tokio::spawn(async move {
        shutdown.await;
        // No receiver is left only when the server has ended by itself.
        let _ = stop.send(true);
    });
    info!(address = %local, "listening");
    bound(local);
    let mut drained = stopping.clone();
    let served = axum::serve(listener, app).with_graceful_shutdown(async move {
        let _ = drained.wait_for(|stop| *stop).await;
    });
    let mut stopping = stopping;
    tokio::select! {
        ended = served => ended.map_err(ServeError::Listener),
        () = async {
            let _ = stopping.wait_for(|stop| *stop).await;
            tokio::time::sleep(GRACE).await;
        } => {
            info!("some connections did not end in time");
            Ok(())
        }
    }
}
