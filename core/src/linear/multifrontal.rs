//! Numeric Cholesky factorisation and solution over the tree of supernodes.

#![expect(
    clippy::inline_always,
    reason = "compiled once per instruction set only where inlined into the caller that enables it"
)]

use super::dense;
use super::supernodes::{Supernode, Tree};
use crate::lane::has_fma;

/// Right-hand sides that are solved together.
const MOST_COLUMNS: usize = 4;

/// L of L L', panel by panel, with the storage of its computation.
pub(super) struct Multifrontal {
    tree: Tree,
    panels: Vec<f64>,
    stack: Vec<f64>,
    /// Right-hand sides in elimination order, and a front's part of them.
    ordered: Vec<f64>,
    front: Vec<f64>,
    fma: bool,
}

impl Multifrontal {
    pub fn new(tree: Tree, unknowns: usize) -> Self {
        let rows = tree.nodes.iter().map(Supernode::rows).max().unwrap_or(0);
        Self {
            panels: vec![0.0; tree.panels],
            stack: vec![0.0; tree.stack],
            ordered: vec![0.0; MOST_COLUMNS * unknowns],
            front: vec![0.0; MOST_COLUMNS * rows],
            fma: has_fma(),
            tree,
        }
    }

    /// Factorises the matrix with these values; `false` where it is not positive definite.
    pub fn factorise(&mut self, values: &[f64]) -> bool {
        let (tree, panels, stack) = (&self.tree, &mut self.panels, &mut self.stack);
        #[cfg(target_arch = "x86_64")]
        if self.fma {
            // SAFETY: `fma` is set only where `has_fma` found both instruction sets.
            return unsafe { fast::factorise(tree, values, panels, stack) };
        }
        if self.fma {
            factorise::<true>(tree, values, panels, stack)
        } else {
            factorise::<false>(tree, values, panels, stack)
        }
    }

    /// Solves in place for right-hand sides stored one after the other; `order[k]` is the unknown at place k.
    pub fn solve(&mut self, rhs: &mut [f64], order: &[u32]) {
        let (tree, panels) = (&self.tree, &self.panels);
        let n = order.len();
        for rhs in rhs.chunks_mut(MOST_COLUMNS * n) {
            let x = &mut self.ordered[..rhs.len()];
            for (x, rhs) in x.chunks_mut(n).zip(rhs.chunks(n)) {
                for (x, &v) in x.iter_mut().zip(order) {
                    *x = rhs[v as usize];
                }
            }
            solve_together(tree, panels, x, &mut self.front, self.fma);
            for (x, rhs) in x.chunks(n).zip(rhs.chunks_mut(n)) {
                for (x, &v) in x.iter().zip(order) {
                    rhs[v as usize] = *x;
                }
            }
        }
    }
}

fn solve_together(tree: &Tree, panels: &[f64], x: &mut [f64], front: &mut [f64], fma: bool) {
    #[cfg(target_arch = "x86_64")]
    if fma {
        // SAFETY: `fma` is set only where `has_fma` found both instruction sets.
        unsafe { fast::solve(tree, panels, x, front) };
        return;
    }
    if fma {
        solve::<true>(tree, panels, x, front);
    } else {
        solve::<false>(tree, panels, x, front);
    }
}

/// The same compiled for AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
mod fast {
    use super::Tree;

    #[target_feature(enable = "avx2,fma")]
    pub fn factorise(tree: &Tree, values: &[f64], panels: &mut [f64], stack: &mut [f64]) -> bool {
        super::factorise::<true>(tree, values, panels, stack)
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn solve(tree: &Tree, panels: &[f64], x: &mut [f64], front: &mut [f64]) {
        super::solve::<true>(tree, panels, x, front);
    }
}

#[inline(always)]
fn factorise<const FMA: bool>(
    tree: &Tree,
    values: &[f64],
    panels: &mut [f64],
    stack: &mut [f64],
) -> bool {
    for node in &tree.nodes {
        let rows = node.rows();
        let panel = &mut panels[node.panel..node.panel + node.width * rows];
        panel.fill(0.0);
        for &(slot, at) in &tree.entries[node.entries.0..node.entries.1] {
            panel[at as usize] = values[slot as usize];
        }
        for k in node.columns..node.width {
            panel[k * rows + k] = 1.0;
        }
        let children = &tree.children[node.children.0..node.children.1];
        for &child in children {
            let child = &tree.nodes[child as usize];
            let update = &stack[child.update..child.update + child.height * child.height];
            add_columns(
                tree,
                child,
                update,
                0..child.eliminated_next,
                panel,
                rows,
                0,
            );
        }
        if !dense::factorise_panel::<FMA>(panel, node.width, rows) {
            return false;
        }
        let height = node.height;
        let own = node.update..node.update + height * height;
        dense::update::<FMA>(panel, node.width, rows, &mut stack[own.clone()]);
        for &child in children {
            let child = &tree.nodes[child as usize];
            let size = child.height * child.height;
            // Updates that are alive at a time do not overlap.
            let (update, own): (&[f64], &mut [f64]) = if child.update < node.update {
                let (low, high) = stack.split_at_mut(node.update);
                (
                    &low[child.update..child.update + size],
                    &mut high[..own.len()],
                )
            } else {
                let (low, high) = stack.split_at_mut(child.update);
                (&high[..size], &mut low[own.clone()])
            };
            let count = child.pattern.1 - child.pattern.0;
            add_columns(
                tree,
                child,
                update,
                child.eliminated_next..count,
                own,
                height,
                node.width,
            );
        }
    }
    true
}

/// Adds columns of a child's update to columns `rows` apart whose first row is row `first` of the parent's front.
#[inline(always)]
fn add_columns(
    tree: &Tree,
    child: &Supernode,
    update: &[f64],
    columns: std::ops::Range<usize>,
    target: &mut [f64],
    rows: usize,
    first: usize,
) {
    let mut runs = &tree.runs[child.runs.0..child.runs.1];
    for j in columns {
        let source = &update[j * child.height..(j + 1) * child.height];
        while runs[0].from + runs[0].len <= j {
            runs = &runs[1..];
        }
        let column = runs[0].to + j - runs[0].from - first;
        let target = &mut target[column * rows..(column + 1) * rows];
        let mut skip = j - runs[0].from;
        for run in runs {
            let (from, to) = (run.from + skip, run.to + skip - first);
            let len = run.len - skip;
            for (t, s) in target[to..to + len]
                .iter_mut()
                .zip(&source[from..from + len])
            {
                *t += s;
            }
            skip = 0;
        }
    }
}

/// Solves for right-hand sides in elimination order, stored one after the other, panel by panel.
#[inline(always)]
fn solve<const FMA: bool>(tree: &Tree, panels: &[f64], x: &mut [f64], front: &mut [f64]) {
    let Some(n) = tree.nodes.iter().map(|s| s.start + s.columns).max() else {
        return;
    };
    for node in &tree.nodes {
        let (width, rows) = (node.width, node.rows());
        let panel = &panels[node.panel..node.panel + width * rows];
        let pattern = &tree.pattern[node.pattern.0..node.pattern.1];
        for x in x.chunks_mut(n) {
            let own = node.start..node.start + node.columns;
            front[..node.columns].copy_from_slice(&x[own.clone()]);
            front[node.columns..rows].fill(0.0);
            dense::forward::<FMA>(panel, width, rows, front);
            x[own].copy_from_slice(&front[..node.columns]);
            for (&r, v) in pattern.iter().zip(&front[width..]) {
                x[r as usize] += v;
            }
        }
    }
    for node in tree.nodes.iter().rev() {
        let (width, rows) = (node.width, node.rows());
        let panel = &panels[node.panel..node.panel + width * rows];
        let pattern = &tree.pattern[node.pattern.0..node.pattern.1];
        for x in x.chunks_mut(n) {
            let own = node.start..node.start + node.columns;
            front[..node.columns].copy_from_slice(&x[own.clone()]);
            front[node.columns..rows].fill(0.0);
            for (v, &r) in front[width..].iter_mut().zip(pattern) {
                *v = x[r as usize];
            }
            dense::backward::<FMA>(panel, width, rows, front);
            x[own].copy_from_slice(&front[..node.columns]);
        }
    }
}
