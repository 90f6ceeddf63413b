//! The conformance suite on a file, and what is SQLite's own.

use std::path::PathBuf;

use salp_server::conformance;
use salp_server::store::Store;

use crate::SqliteStore;

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("salp-store-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[tokio::test]
async fn conforms() {
    let scratch = Scratch::new("conforms");
    let store = SqliteStore::open(&scratch.0.join("salp.db")).await.unwrap();
    conformance::run(&store).await;
    store.close().await;
}

#[tokio::test]
async fn acknowledged_writes_are_on_the_disk() {
    let scratch = Scratch::new("settings");
    let store = SqliteStore::open(&scratch.0.join("salp.db")).await.unwrap();
    let mut connection = store.writer.acquire().await.unwrap();
    // Queries without a table have no data to be checked against.
    let journal: String = sqlx::query_scalar("PRAGMA journal_mode")
        .fetch_one(&mut *connection)
        .await
        .unwrap();
    let synchronous: i64 = sqlx::query_scalar("PRAGMA synchronous")
        .fetch_one(&mut *connection)
        .await
        .unwrap();
    assert_eq!((journal.as_str(), synchronous), ("wal", 2));
}

#[tokio::test]
async fn a_file_that_is_no_store_is_an_error() {
    let scratch = Scratch::new("garbage");
    let file = scratch.0.join("salp.db");
    std::fs::write(&file, vec![b'x'; 5000]).unwrap();
    assert!(SqliteStore::open(&file).await.is_err());
    assert!(
        SqliteStore::open(&scratch.0.join("no/folder.db"))
            .await
            .is_err()
    );
    let store = SqliteStore::open(&scratch.0.join("fine.db")).await.unwrap();
    store.ping().await.unwrap();
}
