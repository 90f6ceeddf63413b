//! `salp serve`: the coordinator.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use salp_server::ServerConfig;
use salp_server::config::Token;
use salp_store_sqlite::SqliteStore;
use serde_json::json;
use tokio::signal::unix::{SignalKind, signal};

use crate::client::token;
use crate::failure::Failure;
use crate::output::Output;

/// Arguments of `salp serve`.
#[derive(Args)]
pub struct Serve {
    /// Address to listen on; port 0 takes a free one
    #[arg(long, default_value = "127.0.0.1:7257")]
    listen: SocketAddr,
    /// SQLite file; created if need be
    #[arg(long, default_value = "salp.db")]
    store: PathBuf,
    /// File with the token that clients and workers must send, else the environment's SALP_TOKEN; needed for addresses
    /// other than loopback
    #[arg(long)]
    token_file: Option<PathBuf>,
    /// Takes studies whose models are programs
    #[arg(long)]
    allow_commands: bool,
    /// Length of a worker's lease, s
    #[arg(long, default_value_t = 15.0)]
    lease: f64,
}

impl Serve {
    /// Serves until SIGTERM or SIGINT.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let token = match token(self.token_file.as_ref())? {
            Some(text) => {
                Some(Token::new(&text).map_err(|e| Failure::fault("token_file", e.to_string()))?)
            }
            None => None,
        };
        let mut config = ServerConfig::new(self.listen, token)
            .map_err(|e| Failure::fault("listen", e.to_string()))?;
        config.allow_commands = self.allow_commands;
        config.lease = Duration::try_from_secs_f64(self.lease)
            .ok()
            .filter(|lease| *lease >= Duration::from_millis(100))
            .ok_or_else(|| Failure::fault("lease", "a lease lasts at least 0.1 s"))?;
        let system = |source| Failure::System {
            doing: "start the coordinator",
            source,
        };
        let failed = |error: &dyn std::error::Error| Failure::Coordinator(error.to_string());
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .enable_all()
            .build()
            .map_err(system)?;
        runtime.block_on(async {
            let store = SqliteStore::open(&self.store)
                .await
                .map_err(|e| failed(&e))?;
            let store = Arc::new(store);
            let mut terminate = signal(SignalKind::terminate()).map_err(system)?;
            let mut interrupt = signal(SignalKind::interrupt()).map_err(system)?;
            let shutdown = async move {
                tokio::select! {
                    _ = terminate.recv() => {}
                    _ = interrupt.recv() => {}
                }
            };
            let bound = move |address: SocketAddr| {
                let url = format!("http://{address}");
                output.print(&json!({ "url": url }), || format!("listening on {url}"));
            };
            let served = salp_server::serve(config, Arc::clone(&store) as _, bound, shutdown).await;
            store.close().await;
            served.map_err(|e| failed(&e))
        })
    }
}
