//! Who a worker is. A study is bit-identical only on one build of the solver and one instruction set.

use salp_protocol::{WorkerId, WorkerIdentity};

/// Version, and a hash over the sources of the solver and the versions of its dependencies.
pub const BUILD: &str = env!("SALP_BUILD");

/// This process.
///
/// # Errors
/// Where the system gives no random numbers.
pub fn identity() -> Result<WorkerIdentity, getrandom::Error> {
    let host = rustix::system::uname()
        .nodename()
        .to_string_lossy()
        .into_owned();
    let pid = std::process::id();
    let once = getrandom::u32()?;
    Ok(WorkerIdentity {
        id: WorkerId(format!("{host}-{pid}-{once:08x}")),
        host,
        pid,
        build: BUILD.to_owned(),
        instruction_set: instruction_set(),
    })
}

/// The architecture with those extensions that the linear algebra chooses between at run time.
pub fn instruction_set() -> String {
    let mut set = String::from(std::env::consts::ARCH);
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx512f") {
            set += "+avx512";
        } else if std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("fma")
        {
            set += "+avx2";
        }
    }
    set
}
