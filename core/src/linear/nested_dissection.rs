//! Fill-reducing ordering from the places of the elements.
//!
//! The elements are split in two by a straight cut; the nodes that both halves share are the separator and are numbered
//! last, then each half in the same way. Splitting elements rather than nodes keeps a separator one line of nodes thick,
//! also for quadratic elements. Of cuts along x and y at several fractions the one with the fewest shared nodes is taken,
//! which finds the thin places between chambers.

/// Parts of this many elements are not split further.
const LEAF: usize = 1;
/// Parts larger than this are cut at three fractions instead of seven.
const LARGE: usize = 4000;

/// Elements with their nodes.
pub struct Elements<'a> {
    /// Nodes per element.
    pub nodes: Vec<&'a [u32]>,
    /// Centroid of each element.
    pub centroid: Vec<[f64; 2]>,
}

/// New order of the `count` nodes: `order[k]` is the node numbered k.
pub fn nested_dissection(elements: &Elements<'_>, count: usize) -> Vec<u32> {
    let mut part: Vec<u32> = (0..elements.nodes.len() as u32).collect();
    let mut this = Dissection {
        elements,
        rank: [ranks(&elements.centroid, 0), ranks(&elements.centroid, 1)],
        mark: vec![0; count],
        stamp: 0,
        numbered: vec![false; count],
        reversed: Vec::with_capacity(count),
    };
    // Numbered from the back: the separator of the whole comes last.
    let mut stack = vec![(0, part.len())];
    while let Some((start, end)) = stack.pop() {
        let middle = this.split(&mut part[start..end]);
        if let Some(middle) = middle {
            stack.push((start, start + middle));
            stack.push((start + middle, end));
        }
    }
    let mut order = this.reversed;
    // Nodes of no element.
    order.extend((0..count as u32).filter(|&v| !this.numbered[v as usize]));
    order.reverse();
    order
}

/// Ranks of the elements along an axis, ties broken by the other axis.
fn ranks(centroid: &[[f64; 2]], axis: usize) -> Vec<u32> {
    let mut sorted: Vec<u32> = (0..centroid.len() as u32).collect();
    sorted.sort_unstable_by(|&a, &b| {
        let (p, q) = (centroid[a as usize], centroid[b as usize]);
        p[axis]
            .total_cmp(&q[axis])
            .then(p[1 - axis].total_cmp(&q[1 - axis]))
            .then(a.cmp(&b))
    });
    let mut rank = vec![0; sorted.len()];
    for (k, &e) in sorted.iter().enumerate() {
        rank[e as usize] = k as u32;
    }
    rank
}

struct Dissection<'a> {
    elements: &'a Elements<'a>,
    rank: [Vec<u32>; 2],
    mark: Vec<u32>,
    stamp: u32,
    numbered: Vec<bool>,
    reversed: Vec<u32>,
}

impl Dissection<'_> {
    /// Numbers the separator of a part, or the whole of a leaf; the number of elements in its first half.
    fn split(&mut self, part: &mut [u32]) -> Option<usize> {
        if part.len() <= LEAF {
            for &e in part.iter() {
                for &v in self.elements.nodes[e as usize] {
                    self.number(v);
                }
            }
            return None;
        }
        let fractions: &[f64] = if part.len() > LARGE {
            &[0.5, 0.4, 0.6]
        } else {
            &[0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65]
        };
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in 0..2 {
            self.sort(part, axis);
            for &fraction in fractions {
                let middle = ((part.len() as f64 * fraction) as usize).clamp(1, part.len() - 1);
                let shared = self.separator(part, middle, false);
                let balance = middle.max(part.len() - middle) as f64 / part.len() as f64;
                let score = shared as f64 * (0.5 + balance);
                if best.is_none_or(|(s, _, _)| score < s) {
                    best = Some((score, axis, middle));
                }
            }
        }
        let (_, axis, middle) = best?;
        self.sort(part, axis);
        self.separator(part, middle, true);
        Some(middle)
    }

    fn sort(&self, part: &mut [u32], axis: usize) {
        let rank = &self.rank[axis];
        part.sort_unstable_by_key(|&e| rank[e as usize]);
    }

    /// Counts, and with `number` numbers, the free nodes that both halves share.
    fn separator(&mut self, part: &[u32], middle: usize, number: bool) -> usize {
        self.stamp += 2;
        for &e in &part[..middle] {
            for &v in self.elements.nodes[e as usize] {
                self.mark[v as usize] = self.stamp;
            }
        }
        let mut shared = 0;
        for &e in &part[middle..] {
            for &v in self.elements.nodes[e as usize] {
                if self.mark[v as usize] == self.stamp && !self.numbered[v as usize] {
                    self.mark[v as usize] = self.stamp + 1;
                    shared += 1;
                    if number {
                        self.number(v);
                    }
                }
            }
        }
        shared
    }

    fn number(&mut self, node: u32) {
        if !self.numbered[node as usize] {
            self.numbered[node as usize] = true;
            self.reversed.push(node);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_every_node_once_and_the_separator_last() {
        let m = 8_u32;
        let quads: Vec<[u32; 4]> = (0..m * m)
            .map(|k| {
                let (i, j) = (k % m, k / m);
                let at = |i: u32, j: u32| j * (m + 1) + i;
                [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
            })
            .collect();
        let elements = Elements {
            nodes: quads.iter().map(<[u32; 4]>::as_slice).collect(),
            centroid: (0..m * m)
                .map(|k| [f64::from(k % m), f64::from(k / m)])
                .collect(),
        };
        let count = ((m + 1) * (m + 1)) as usize;
        let order = nested_dissection(&elements, count);
        let mut seen = order.clone();
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(k, v)| k as u32 == *v));
        // The last numbered nodes are the middle grid line.
        let last = &order[count - (m as usize + 1)..];
        assert!(
            last.iter().all(|v| v % (m + 1) == m / 2) || last.iter().all(|v| v / (m + 1) == m / 2)
        );
    }
}
