//! The coordinator in this process, on a thread and a runtime of its own.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread::JoinHandle;
use std::time::Duration;

use salp_server::ServerConfig;
use salp_store_sqlite::SqliteStore;
use salp_worker::Client;
use tokio::sync::oneshot;

use crate::failure::Failure;

/// A running coordinator.
pub struct Coordinator {
    url: String,
    stop: oneshot::Sender<()>,
    thread: JoinHandle<Result<(), String>>,
}

impl Coordinator {
    /// Starts on a free port of the loopback address.
    pub fn start(store: &Path, allow_commands: bool) -> Result<Self, Failure> {
        let listen = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let mut config =
            ServerConfig::new(listen, None).map_err(|e| Failure::Coordinator(e.to_string()))?;
        config.allow_commands = allow_commands;
        config.workers_end_with_it = true;
        let store = store.to_owned();
        let (stop, stopped) = oneshot::channel();
        let (tell, told) = channel();
        let thread = std::thread::Builder::new()
            .name("coordinator".into())
            .spawn(move || {
                let runtime = tokio::runtime::Builder::new_multi_thread()
                    .worker_threads(2)
                    .enable_all()
                    .build()
                    .map_err(|e| e.to_string())?;
                runtime.block_on(async move {
                    let store = SqliteStore::open(&store).await.map_err(|e| e.to_string())?;
                    let store = Arc::new(store);
                    let bound = move |address: SocketAddr| {
                        // Nobody listens any more only if this process is ending.
                        let _ = tell.send(address);
                    };
                    let shutdown = async {
                        // A dropped sender ends it as well.
                        let _ = stopped.await;
                    };
                    let served =
                        salp_server::serve(config, Arc::clone(&store) as _, bound, shutdown).await;
                    store.close().await;
                    served.map_err(|e| e.to_string())
                })
            })
            .map_err(|source| Failure::System {
                doing: "start a thread",
                source,
            })?;
        match told.recv() {
            Ok(address) => Ok(Self {
                url: format!("http://{address}"),
                stop,
                thread,
            }),
            // The thread ended before it listened.
            Err(_) => Err(ended(thread)
                .err()
                .unwrap_or_else(|| Failure::Coordinator("it ended before it listened".into()))),
        }
    }

    /// Its address.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Whether it has not ended by itself.
    pub fn is_running(&self) -> bool {
        !self.thread.is_finished()
    }

    /// A client of it.
    pub fn client(&self) -> Client {
        Client::new(&self.url, None, Duration::from_mins(1))
    }

    /// Finishes what is under way and closes the store.
    pub fn stop(self) -> Result<(), Failure> {
        // Where the receiver is gone the thread has ended, and says why.
        let _ = self.stop.send(());
        ended(self.thread)
    }
}

fn ended(thread: JoinHandle<Result<(), String>>) -> Result<(), Failure> {
    match thread.join() {
        Ok(Ok(())) => Ok(()),
        Ok(Err(why)) => Err(Failure::Coordinator(why)),
        Err(_) => Err(Failure::Coordinator("it panicked".into())),
    }
}
