//! Signals and the end of the parent.

use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use signal_hook::consts::{SIGINT, SIGTERM};

/// How urgently the worker is to end.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicUsize>);

impl Stop {
    /// Ends the worker after its evaluation; asked again, at once.
    pub fn ask(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// Whether the worker ends after its evaluation.
    pub fn after_this(&self) -> bool {
        self.0.load(Ordering::Relaxed) >= 1
    }

    /// Whether the worker ends at once.
    pub fn at_once(&self) -> bool {
        self.0.load(Ordering::Relaxed) >= 2
    }

    /// Asks at every SIGTERM and SIGINT.
    ///
    /// # Errors
    /// Where the system refuses the handlers.
    pub fn take_signals(&self) -> std::io::Result<()> {
        let mut signals = signal_hook::iterator::Signals::new([SIGTERM, SIGINT])?;
        let stop = self.clone();
        thread::Builder::new()
            .name("signals".into())
            .spawn(move || {
                for _ in signals.forever() {
                    stop.ask();
                }
            })?;
        Ok(())
    }
}

/// Ends this process, programs included, when its standard input ends.
///
/// # Errors
/// Where the system has no thread to give.
pub fn die_with_parent() -> std::io::Result<()> {
    thread::Builder::new().name("parent".into()).spawn(|| {
        let mut buffer = [0_u8; 64];
        let mut input = std::io::stdin();
        loop {
            match input.read(&mut buffer) {
                Ok(0) => break,
                Err(failure) if failure.kind() != std::io::ErrorKind::Interrupted => break,
                _ => {}
            }
        }
        crate::command::kill_all();
        std::process::exit(0);
    })?;
    Ok(())
}
