//! Dense kernels of a front: panels and updates column by column, all sizes multiples of four.

#![expect(
    clippy::inline_always,
    reason = "compiled once per instruction set only where inlined into the caller that enables it"
)]

use crate::lane::Pack;

#[inline(always)]
fn load(a: &[f64]) -> Pack {
    Pack([a[0], a[1], a[2], a[3]])
}

/// Sum over the first `k` columns of a[0..4 R, p] b[0..4, p], both with columns `rows` apart: `sum[c][r]` holds column c.
#[inline(always)]
fn products<const FMA: bool, const R: usize>(
    a: &[f64],
    b: &[f64],
    rows: usize,
    k: usize,
) -> [[Pack; R]; 4] {
    let mut sum = [[Pack::ZERO; R]; 4];
    for p in 0..k {
        let (a, b) = (&a[p * rows..p * rows + 4 * R], &b[p * rows..p * rows + 4]);
        let x: [Pack; R] = std::array::from_fn(|r| load(&a[4 * r..4 * r + 4]));
        for c in 0..4 {
            let b = Pack::splat(b[c]);
            for r in 0..R {
                sum[c][r] = x[r].fma::<FMA>(b, sum[c][r]);
            }
        }
    }
    sum
}

/// The inverse diagonal and the lower triangle of a factored 4 x 4 block.
struct Corner {
    inverse: [f64; 4],
    l: [[f64; 4]; 4],
}

/// Factorises the 4 x 4 block at rows 0..4 of four columns; `None` where it is not positive definite.
#[inline(always)]
fn corner(columns: &mut [f64], rows: usize) -> Option<Corner> {
    let mut l = [[0.0; 4]; 4];
    let mut inverse = [0.0; 4];
    for j in 0..4 {
        let mut pivot = columns[j * rows + j];
        for p in 0..j {
            pivot -= l[j][p] * l[j][p];
        }
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        l[j][j] = pivot.sqrt();
        inverse[j] = 1.0 / l[j][j];
        for i in j + 1..4 {
            let mut v = columns[j * rows + i];
            for p in 0..j {
                v -= l[i][p] * l[j][p];
            }
            l[i][j] = v * inverse[j];
        }
        for i in j..4 {
            columns[j * rows + i] = l[i][j];
        }
    }
    Some(Corner { inverse, l })
}

/// Updates 4 R rows of four columns by the columns before them and solves with the corner's transpose.
#[inline(always)]
fn eliminate<const FMA: bool, const R: usize>(
    before: &[f64],
    columns: &mut [f64],
    rows: usize,
    k: usize,
    place: [usize; 2],
    with: &Corner,
) {
    let [j, i] = place;
    // The first columns have none before them.
    let sum = if k > 0 {
        products::<FMA, R>(&before[i..], &before[j..], rows, k)
    } else {
        [[Pack::ZERO; R]; 4]
    };
    for r in 0..R {
        let mut x = [Pack::ZERO; 4];
        for c in 0..4 {
            let at = c * rows + i + 4 * r;
            let mut v = load(&columns[at..at + 4]) - sum[c][r];
            for p in 0..c {
                v = (-x[p]).fma::<FMA>(Pack::splat(with.l[c][p]), v);
            }
            x[c] = v * with.inverse[c];
            columns[at..at + 4].copy_from_slice(&x[c].0);
        }
    }
}

/// Cholesky factorisation of the `width` columns of a panel; whether it is positive definite.
#[inline(always)]
pub(super) fn factorise_panel<const FMA: bool>(
    panel: &mut [f64],
    width: usize,
    rows: usize,
) -> bool {
    for j in (0..width).step_by(4) {
        let (before, columns) = panel.split_at_mut(j * rows);
        let columns = &mut columns[..4 * rows];
        if j > 0 {
            let sum = products::<FMA, 1>(&before[j..], &before[j..], rows, j);
            for c in 0..4 {
                for r in 0..4 {
                    columns[c * rows + j + r] -= sum[c][0].0[r];
                }
            }
        }
        let Some(with) = corner(&mut columns[j..], rows) else {
            return false;
        };
        let mut i = j + 4;
        while i + 12 <= rows {
            eliminate::<FMA, 3>(before, columns, rows, j, [j, i], &with);
            i += 12;
        }
        if i + 8 <= rows {
            eliminate::<FMA, 2>(before, columns, rows, j, [j, i], &with);
            i += 8;
        }
        if i + 4 <= rows {
            eliminate::<FMA, 1>(before, columns, rows, j, [j, i], &with);
        }
    }
    true
}

/// update = -B B' in its lower triangle, B the rows of a panel from `width` on.
#[inline(always)]
pub(super) fn update<const FMA: bool>(
    panel: &[f64],
    width: usize,
    rows: usize,
    update: &mut [f64],
) {
    let height = rows - width;
    let b = &panel[width..];
    for j in (0..height).step_by(4) {
        let mut i = j;
        let columns = &mut update[j * height..(j + 4) * height];
        macro_rules! tile {
            ($r:literal) => {
                let sum = products::<FMA, $r>(&b[i..], &b[j..], rows, width);
                for c in 0..4 {
                    for r in 0..$r {
                        let at = c * height + i + 4 * r;
                        columns[at..at + 4].copy_from_slice(&(-sum[c][r]).0);
                    }
                }
                i += 4 * $r;
            };
        }
        while i + 12 <= height {
            tile!(3);
        }
        if i + 8 <= height {
            tile!(2);
        }
        if i + 4 <= height {
            tile!(1);
        }
        let _ = i;
    }
}

/// Solves L x = t for the panel's columns and subtracts their products from the rows below.
#[inline(always)]
pub(super) fn forward<const FMA: bool>(panel: &[f64], width: usize, rows: usize, t: &mut [f64]) {
    let t = &mut t[..rows];
    for j in (0..width).step_by(4) {
        let columns = &panel[j * rows..(j + 4) * rows];
        let mut x = [0.0; 4];
        for c in 0..4 {
            let mut v = t[j + c];
            for p in 0..c {
                v -= columns[p * rows + j + c] * x[p];
            }
            x[c] = v / columns[c * rows + j + c];
            t[j + c] = x[c];
        }
        let (a, rest) = columns.split_at(rows);
        let (b, rest) = rest.split_at(rows);
        let (c, d) = rest.split_at(rows);
        let x = x.map(|v| Pack::splat(-v));
        for i in (j + 4..rows).step_by(4) {
            let mut v = load(&t[i..i + 4]);
            v = load(&a[i..i + 4]).fma::<FMA>(x[0], v);
            v = load(&b[i..i + 4]).fma::<FMA>(x[1], v);
            v = load(&c[i..i + 4]).fma::<FMA>(x[2], v);
            v = load(&d[i..i + 4]).fma::<FMA>(x[3], v);
            t[i..i + 4].copy_from_slice(&v.0);
        }
    }
}

/// Solves L' x = t for the panel's columns, the rows below them known.
#[inline(always)]
pub(super) fn backward<const FMA: bool>(panel: &[f64], width: usize, rows: usize, t: &mut [f64]) {
    let t = &mut t[..rows];
    for j in (0..width).step_by(4).rev() {
        let columns = &panel[j * rows..(j + 4) * rows];
        let mut sum = [Pack::ZERO; 4];
        for i in (j + 4..rows).step_by(4) {
            let x = load(&t[i..i + 4]);
            for c in 0..4 {
                sum[c] = load(&columns[c * rows + i..c * rows + i + 4]).fma::<FMA>(x, sum[c]);
            }
        }
        for c in (0..4).rev() {
            let mut v = t[j + c] - sum[c].0.iter().sum::<f64>();
            for p in c + 1..4 {
                v -= columns[c * rows + j + p] * t[j + p];
            }
            t[j + c] = v / columns[c * rows + j + c];
        }
    }
}
