//! Real processes over loopback: coordinators, workers, and a study whose model is a small program.

#![allow(dead_code, reason = "each test target uses its own part")]

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use salp_protocol::{EvaluationRow, StudyId, StudyState, StudyView};
use salp_worker::Client;
use serde_json::{Value, json};

/// The executable.
pub const SALP: &str = env!("CARGO_BIN_EXE_salp");

/// Answers after a pause of argv[1] seconds. Smooth, with one constraint that is active at the optimum.
const MODEL: &str = r"
import json, math, sys, time
pause = float(sys.argv[1])
for line in sys.stdin:
    x = json.loads(line)['x']
    time.sleep(pause)
    f = sum((a - i) ** 2 + math.sin(a) / 10 for i, a in enumerate(x))
    g = sum(a * a for a in x) - 2.0
    print(json.dumps({'objective': f, 'constraints': [g]}), flush=True)
";

/// A folder of one test, removed at its end.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(test: &str) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("salp-{test}-{}-{count}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join("model.py"), MODEL).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Two restarts of MMFD with differences in three variables: batches of one and of three.
pub fn study(pause_s: f64) -> Value {
    json!({
        "name": "sphere",
        "step": [{
            "id": "solve",
            "model": {"kind": "command", "argv": ["python3", "model.py", pause_s.to_string()], "time_limit_s": 20, "gradient": false},
            "variables": {"lower": [-4.0, -4.0, -4.0], "upper": [4.0, 4.0, 4.0]},
            "constraints": {"inequalities": 1, "equalities": 0},
            "optimiser": {"method": "mmfd", "gradient": "differences", "difference_step": 1e-3, "max_iterations": 4},
            "restarts": {"start": "given", "points": [[0.3, 0.2, -0.1], [-0.5, 0.1, 0.4]]}
        }]
    })
}

/// Six restarts that compete in two rungs, at checks, and by merging; a program has one fidelity, so that the rungs differ by
/// their evaluations alone.
pub fn race(pause_s: f64) -> Value {
    let mut document = study(pause_s);
    document["step"][0]["restarts"] = json!({
        "start": "given",
        "points": [[0.3, 0.2, -0.1], [-0.5, 0.1, 0.4], [0.9, 0.1, 0.3], [0.1, 0.9, 0.9], [-0.9, 0.2, 0.1], [0.31, 0.2, -0.1]],
        "race": {"rungs": [{"evaluations": 4}, {"evaluations": 8}], "eta": 2},
        "stop_dominated": {"every": 6},
        "merge_within": 0.005,
    });
    document
}

/// A process that is killed when the test lets go of it.
pub struct Process {
    child: Child,
    log: PathBuf,
}

impl Process {
    /// Takes charge of a child whose standard error goes to `log`.
    pub fn new(child: Child, log: PathBuf) -> Self {
        Self { child, log }
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal by name.
    pub fn signal(&self, name: &str) {
        let status = Command::new("kill")
            .args([&format!("-{name}"), &self.id().to_string()])
            .status();
        assert!(status.unwrap().success());
    }

    /// kill -9.
    pub fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Closes the standard input.
    pub fn close_input(&mut self) {
        drop(self.child.stdin.take());
    }

    /// Waits for the end; whether it was a good one.
    pub fn ends_well(&mut self, within: Duration) -> bool {
        self.exit_code(within) == Some(0)
    }

    /// Waits for the end; `None` after a signal.
    pub fn exit_code(&mut self, within: Duration) -> Option<i32> {
        let until = Instant::now() + within;
        while Instant::now() < until {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            pause();
        }
        panic!("still alive after {within:?}: {}", self.said());
    }

    /// What it wrote to its standard error.
    pub fn said(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// Process ids of its children.
    pub fn children(&self) -> Vec<u32> {
        let path = format!("/proc/{0}/task/{0}/children", self.id());
        let text = std::fs::read_to_string(path).unwrap_or_default();
        text.split_whitespace()
            .filter_map(|id| id.parse().ok())
            .collect()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Whether a process is alive and no zombie.
pub fn is_alive(id: u32) -> bool {
    std::fs::read_to_string(format!("/proc/{id}/stat")).is_ok_and(|stat| !stat.contains(") Z "))
}

/// A coordinator.
pub struct Coordinator {
    pub process: Process,
    pub url: String,
    pub client: Client,
}

/// Starts a coordinator on the folder's store; `listen` is `127.0.0.1:0` for a free port.
pub fn serve(folder: &Folder, listen: &str, more: &[&str]) -> Coordinator {
    let log = folder.0.join(format!("serve-{}.log", stamp()));
    let mut child = Command::new(SALP)
        .arg("serve")
        .args(["--listen", listen, "--json", "--allow-commands"])
        .arg("--store")
        .arg(folder.0.join("salp.db"))
        .args(more)
        .stdout(Stdio::piped())
        .stderr(File::create(&log).unwrap())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap())
        .read_line(&mut line)
        .unwrap();
    let process = Process { child, log };
    let said: Value = serde_json::from_str(&line)
        .unwrap_or_else(|_| panic!("no address in {line:?}: {}", process.said()));
    let url = said["url"].as_str().unwrap().to_owned();
    Coordinator {
        client: Client::new(&url, None, Duration::from_secs(30)),
        process,
        url,
    }
}

/// Starts a worker that may start programs.
pub fn work(folder: &Folder, url: &str, more: &[&str]) -> Process {
    let log = folder.0.join(format!("work-{}.log", stamp()));
    let child = Command::new(SALP)
        .args(["work", url, "--allow-commands"])
        .arg("--folder")
        .arg(&folder.0)
        .args(more)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(File::create(&log).unwrap())
        .spawn()
        .unwrap();
    Process { child, log }
}

fn stamp() -> usize {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    COUNT.fetch_add(1, Ordering::Relaxed)
}

/// A moment.
pub fn pause() {
    std::thread::sleep(Duration::from_millis(20));
}

/// Waits until something holds.
pub fn until(what: &str, within: Duration, mut holds: impl FnMut() -> bool) {
    let end = Instant::now() + within;
    while !holds() {
        assert!(Instant::now() < end, "not within {within:?}: {what}");
        pause();
    }
}

impl Coordinator {
    pub fn submit(&self, document: &Value) -> StudyId {
        self.client.submit(document, None).unwrap().id
    }

    pub fn view(&self, id: &StudyId) -> StudyView {
        self.client.study(id).unwrap()
    }

    pub fn until_answered(&self, id: &StudyId, count: u64) {
        until("answered", Duration::from_secs(30), || {
            self.view(id).counts.answered >= count
        });
    }

    pub fn until_done(&self, id: &StudyId) -> StudyView {
        until("done", Duration::from_mins(1), || {
            self.view(id).state == StudyState::Done
        });
        self.view(id)
    }

    pub fn ledger(&self, id: &StudyId) -> Vec<EvaluationRow> {
        self.client.evaluations(id, false).unwrap()
    }

    /// Hashes of all restarts.
    pub fn histories(&self, id: &StudyId) -> Vec<String> {
        let restarts = self.client.restarts(id).unwrap();
        restarts.into_iter().map(|r| r.history_sha256).collect()
    }
}

/// The histories of an undisturbed run by one worker. The pause is no part of the model's answer, so any pause does.
pub fn undisturbed() -> Vec<String> {
    undisturbed_of(&study(0.0))
}

/// As [`undisturbed`], of another study.
pub fn undisturbed_of(document: &Value) -> Vec<String> {
    let folder = Folder::new("undisturbed");
    let coordinator = serve(&folder, "127.0.0.1:0", &[]);
    let _worker = work(&folder, &coordinator.url, &[]);
    let id = coordinator.submit(document);
    coordinator.until_done(&id);
    coordinator.histories(&id)
}

/// Every evaluation is answered once, by one worker, and none is lost.
pub fn assert_sound(ledger: &[EvaluationRow]) {
    for row in ledger {
        assert_eq!(row.status, "ok", "{row:?}");
        assert!(row.attempt <= 5 && row.fence >= row.attempt, "{row:?}");
    }
}

/// Path of a file of the folder as text.
pub fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
