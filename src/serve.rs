//! `salp serve`: the coordinator.

use std::error::Error;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use salp_server::ServerConfig;
use salp_server::config::Token;
use salp_store_sqlite::SqliteStore;
use tokio::signal::unix::{SignalKind, signal};

/// Arguments of `salp serve`.
#[derive(Args)]
pub struct Serve {
    /// Address to listen on; port 0 takes a free one
    #[arg(long, default_value = "127.0.0.1:7257")]
    listen: SocketAddr,
    /// SQLite file; created if need be
    #[arg(long, default_value = "salp.db")]
    store: PathBuf,
    /// File with the token that clients and workers must send; needed for addresses other than loopback
    #[arg(long)]
    token_file: Option<PathBuf>,
    /// Takes studies whose models are programs
    #[arg(long)]
    allow_commands: bool,
    /// Length of a worker's lease, s
    #[arg(long, default_value_t = 15.0)]
    lease: f64,
    /// Prints the address as JSON
    #[arg(long)]
    json: bool,
}

impl Serve {
    /// Serves until SIGTERM or SIGINT.
    pub fn run(self) -> Result<(), Box<dyn Error>> {
        let token = match (&self.token_file, std::env::var("SALP_TOKEN")) {
            (Some(file), _) => Some(Token::new(&std::fs::read_to_string(file)?)?),
            (None, Ok(text)) => Some(Token::new(&text)?),
            (None, Err(_)) => None,
        };
        let mut config = ServerConfig::new(self.listen, token)?;
        config.allow_commands = self.allow_commands;
        config.lease = Duration::try_from_secs_f64(self.lease)?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .enable_all()
            .build()?;
        runtime.block_on(async {
            let store = Arc::new(SqliteStore::open(&self.store).await?);
            let mut terminate = signal(SignalKind::terminate())?;
            let mut interrupt = signal(SignalKind::interrupt())?;
            let shutdown = async move {
                tokio::select! {
                    _ = terminate.recv() => {}
                    _ = interrupt.recv() => {}
                }
            };
            let json = self.json;
            let bound = move |address: SocketAddr| {
                if json {
                    println!("{{\"url\": \"http://{address}\"}}");
                } else {
                    println!("listening on http://{address}");
                }
            };
            salp_server::serve(config, Arc::clone(&store) as _, bound, shutdown).await?;
            store.close().await;
            Ok(())
        })
    }
}
