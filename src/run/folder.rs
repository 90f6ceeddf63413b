//! The folder of a run: one study, one running process.
//!
//! | file | what |
//! |---|---|
//! | `run.json` | the study, the address, the process and its workers |
//! | `store.db` | the coordinator's store |
//! | `logs/` | what each worker said |
//! | `report/` | curve, best design, summary, ledger |
//! | `lock` | held while a process works here |

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use salp_core::study::{Study, read_study};
use salp_protocol::StudyId;
use salp_worker::identity::{BUILD, instruction_set};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::accuracy::{needs_meshes, with_meshes};
use crate::failure::Failure;
use crate::output::write_file;

/// How often the time is noted.
const BETWEEN_NOTES: Duration = Duration::from_secs(5);

/// `run.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct RunRecord {
    /// Name of the study.
    name: String,
    /// Hash of the resolved study.
    fingerprint: String,
    /// Build and instruction set that evaluate; a study is bit-identical on one only.
    build: String,
    /// Id of the study in the store, once it is there.
    study_id: Option<StudyId>,
    /// Address of the coordinator.
    url: Option<String>,
    /// Process of the coordinator.
    pid: u32,
    /// Processes of the workers.
    workers: Vec<u32>,
    /// Wall time so far, over all runs in this folder, s.
    seconds: f64,
    /// The study with the meshes that were chosen for an error, where it asks for that: chosen once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    with_meshes: Option<Value>,
}

/// A locked folder.
pub struct RunFolder {
    path: PathBuf,
    record: RunRecord,
    /// Wall time of earlier runs, s.
    before: f64,
    opened: Instant,
    saved: Instant,
    /// Held until the end of the process, however it ends.
    _lock: File,
}

impl RunFolder {
    /// Opens or creates the folder of a study; `fresh` removes what an earlier run left.
    pub fn open(path: PathBuf, study: &Study, fresh: bool) -> Result<Self, Failure> {
        let refused = |why: String| Failure::fault("out", format!("{} {why}", path.display()));
        std::fs::create_dir_all(&path).map_err(|e| refused(format!("cannot be created: {e}")))?;
        let lock = File::create(path.join("lock"))
            .map_err(|e| refused(format!("cannot be written to: {e}")))?;
        let earlier = read_record(&path.join("run.json"));
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let who = earlier.ok().flatten().map_or_else(String::new, |record| {
                    format!(
                        " (process {}, {})",
                        record.pid,
                        record.url.unwrap_or_default()
                    )
                });
                return Err(refused(format!("is in use by another salp run{who}")));
            }
            Err(TryLockError::Error(e)) => return Err(refused(format!("cannot be locked: {e}"))),
        }
        if fresh {
            clear(&path)?;
        }
        let mut record = RunRecord {
            name: study.name.clone(),
            fingerprint: study.fingerprint(),
            build: format!("{BUILD} {}", instruction_set()),
            study_id: None,
            url: None,
            pid: std::process::id(),
            workers: Vec::new(),
            seconds: 0.0,
            with_meshes: None,
        };
        match if fresh { Ok(None) } else { earlier } {
            Err(why) => {
                return Err(refused(format!(
                    "holds a run.json that cannot be read: {why}"
                )));
            }
            Ok(Some(old)) if old.fingerprint != record.fingerprint => {
                let hash: String = old.fingerprint.chars().take(8).collect();
                return Err(refused(format!(
                    "holds another study, {} with hash {hash}; --fresh starts over, --out takes another folder",
                    old.name
                )));
            }
            Ok(Some(old)) if old.build != record.build => {
                return Err(refused(
                    "was begun by another build or on another instruction set; --fresh starts over"
                        .into(),
                ));
            }
            Ok(Some(old)) => {
                record.seconds = old.seconds;
                record.study_id = old.study_id;
                record.with_meshes = old.with_meshes;
            }
            Ok(None) if path.join("store.db").exists() => {
                return Err(refused(
                    "holds a store without run.json; --fresh starts over".into(),
                ));
            }
            Ok(None) => {}
        }
        let now = Instant::now();
        let folder = Self {
            path,
            before: record.seconds,
            opened: now,
            saved: now,
            record,
            _lock: lock,
        };
        folder.save()?;
        Ok(folder)
    }

    /// Takes what an earlier run in another folder has evaluated as known, unless this one has a store already: a result is known
    /// by the hash of its model, settings and design, whichever study asked for it.
    pub fn know(&self, earlier: &Path) -> Result<(), Failure> {
        if self.store().exists() {
            return Ok(());
        }
        let refused = |why: String| Failure::fault("known", format!("{} {why}", earlier.display()));
        let record = read_record(&earlier.join("run.json"))
            .map_err(|why| refused(format!("holds a run.json that cannot be read: {why}")))?
            .ok_or_else(|| refused("is no folder of an earlier run".into()))?;
        if record.url.is_some() {
            // What is in its queue would be handed out here.
            return Err(refused(
                "holds a run that is under way, or was killed: let it end or pause it first".into(),
            ));
        }
        for name in ["store.db", "store.db-wal"] {
            match std::fs::copy(earlier.join(name), self.at(name)) {
                Err(e) if e.kind() == std::io::ErrorKind::NotFound && name != "store.db" => {}
                Err(e) => return Err(refused(format!("has no {name} that can be copied: {e}"))),
                Ok(_) => {}
            }
        }
        Ok(())
    }

    /// A path in the folder.
    pub fn at(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The coordinator's store.
    pub fn store(&self) -> PathBuf {
        self.at("store.db")
    }

    /// Wall time so far, s.
    pub fn seconds(&self) -> f64 {
        self.record.seconds
    }

    /// The study as it is submitted: with the meshes that it asks for by their error, chosen when it was first run here.
    pub fn with_meshes(&mut self, study: &Study) -> Result<Study, Failure> {
        if !needs_meshes(study) {
            return Ok(study.clone());
        }
        if let Some(document) = &self.record.with_meshes {
            return Ok(read_study(document, true)?);
        }
        let chosen = with_meshes(study)?;
        self.record.with_meshes = Some(chosen.document());
        self.save()?;
        Ok(chosen)
    }

    /// Notes the study and the address.
    pub fn begun(&mut self, id: &StudyId, url: &str) -> Result<(), Failure> {
        self.record.study_id = Some(id.clone());
        self.record.url = Some(url.to_owned());
        self.save()
    }

    /// Notes the workers.
    pub fn workers(&mut self, pids: Vec<u32>) -> Result<(), Failure> {
        self.record.workers = pids;
        self.save()
    }

    /// Notes the time now and then, so that a run that is killed has not worked for nothing.
    pub fn tick(&mut self) -> Result<(), Failure> {
        if self.saved.elapsed() < BETWEEN_NOTES {
            return Ok(());
        }
        self.saved = Instant::now();
        self.record.seconds = self.before + self.opened.elapsed().as_secs_f64();
        self.save()
    }

    /// Notes that nothing runs any more. A study that had ended before costs no time.
    pub fn ended(&mut self) -> Result<(), Failure> {
        if !self.record.workers.is_empty() {
            self.record.seconds = self.before + self.opened.elapsed().as_secs_f64();
        }
        self.record.url = None;
        self.record.workers.clear();
        self.save()
    }

    fn save(&self) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(&self.record).unwrap_or_default();
        write_file(&self.at("run.json"), &text)
    }
}

fn read_record(file: &Path) -> Result<Option<RunRecord>, String> {
    match std::fs::read_to_string(file) {
        Ok(text) => serde_json::from_str(&text)
            .map(Some)
            .map_err(|e| e.to_string()),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(e.to_string()),
    }
}

/// Removes what a run leaves, and nothing else.
fn clear(path: &Path) -> Result<(), Failure> {
    for name in [
        "run.json",
        "store.db",
        "store.db-wal",
        "store.db-shm",
        "logs",
        "report",
    ] {
        let path = path.join(name);
        let removed = if path.is_dir() {
            std::fs::remove_dir_all(&path)
        } else {
            std::fs::remove_file(&path)
        };
        match removed {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(Failure::File {
                    doing: "remove",
                    path,
                    source,
                });
            }
            _ => {}
        }
    }
    Ok(())
}
