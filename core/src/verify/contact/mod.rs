//! Problems of contact: a disc on a plate, two blocks, a tube between plates, a tube that collapses.

mod collapsed_tube;
mod collapsing_ring;
mod crushed_ring;
mod crushed_tube;
mod hertz;
mod joined;
mod pressed_blocks;
#[cfg(test)]
mod tests;

pub(super) use collapsed_tube::run as run_collapsed_tube;
pub(super) use crushed_tube::run as run_crushed_tube;
pub(super) use hertz::run as run_hertz;
pub(super) use pressed_blocks::run as run_pressed_blocks;

/// E / (1 - nu^2) over mu at a K / mu.
fn plane_modulus(bulk_over_shear: f64) -> f64 {
    let lame = bulk_over_shear - 2.0 / 3.0;
    4.0 * (lame + 1.0) / (lame + 2.0)
}
