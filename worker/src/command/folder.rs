//! The folder in which a program runs, and what is left of those whose worker was killed.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::time::Duration;

/// How names begin.
const PREFIX: &str = "salp-command-";
/// A younger folder may not be locked yet.
const YOUNG: Duration = Duration::from_mins(1);

/// A folder of a program's own, removed with all that the program left in it.
pub struct Folder {
    root: PathBuf,
    /// Held while the folder is in use, by this process alone.
    lock: File,
}

impl Folder {
    /// A new one for temporary files. The first of a process also removes those of workers that were killed.
    pub fn new() -> io::Result<Self> {
        static SWEPT: Once = Once::new();
        let temporary = std::env::temp_dir();
        SWEPT.call_once(|| sweep(&temporary, YOUNG));
        let once = getrandom::u64().map_err(io::Error::other)?;
        Self::at(temporary.join(format!("{PREFIX}{once:016x}")))
    }

    fn at(root: PathBuf) -> io::Result<Self> {
        std::fs::create_dir(&root)?;
        let lock = File::create(lock_of(&root))?;
        lock.lock()?;
        std::fs::create_dir(root.join("work"))?;
        Ok(Self { root, lock })
    }

    /// Where the program runs: empty at first.
    pub fn work(&self) -> PathBuf {
        self.root.join("work")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.root);
        // Closing alone is not enough: a program that another thread starts holds a copy of the file until it runs.
        let _ = self.lock.unlock();
    }
}

fn lock_of(root: &Path) -> PathBuf {
    root.join("lock")
}

/// Removes folders that nobody holds. What cannot be looked at or removed, as that of another user, stays.
fn sweep(temporary: &Path, young: Duration) {
    let Ok(entries) = std::fs::read_dir(temporary) else {
        return;
    };
    let of_ours = |entry: &std::fs::DirEntry| {
        let name = entry.file_name();
        name.to_str().is_some_and(|name| name.starts_with(PREFIX))
    };
    for entry in entries.flatten().filter(of_ours) {
        let age = entry.metadata().and_then(|data| data.modified());
        let age = age.ok().and_then(|time| time.elapsed().ok());
        if age.is_none_or(|age| age < young) {
            continue;
        }
        if let Ok(lock) = File::open(lock_of(&entry.path()))
            && lock.try_lock().is_ok()
        {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_worker_left_is_removed_and_what_another_uses_is_not() {
        let temporary = Folder::new().unwrap();
        let place = |name: &str| temporary.work().join(format!("{PREFIX}{name}"));
        let used = Folder::at(place("used")).unwrap();
        // Killed: nothing is removed, and the lock goes with the process.
        let left = Folder::at(place("left")).unwrap();
        std::fs::write(left.work().join("mesh"), "large").unwrap();
        let root = left.root.clone();
        let saved = place("saved");
        std::fs::rename(&root, &saved).unwrap();
        drop(left);
        std::fs::rename(&saved, &root).unwrap();
        std::fs::create_dir(temporary.work().join("other")).unwrap();
        sweep(&temporary.work(), Duration::from_hours(1));
        assert!(root.exists(), "young ones stay");
        sweep(&temporary.work(), Duration::ZERO);
        assert!(!root.exists());
        assert!(used.work().exists() && temporary.work().join("other").exists());
        drop(used);
        assert!(!place("used").exists());
    }
}
