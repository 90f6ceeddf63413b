//! Fill-reducing ordering from the node positions.
//!
//! Nodes are split at the median along the longer side of their bounding box; the nodes of the first half that touch the
//! second one are the separator and are numbered last. On plane meshes this is cheaper to compute than a graph partition
//! and factorises as fast.

/// Below this many nodes a part is numbered as it is.
const LEAF: usize = 24;

/// New order of the nodes: `order[k]` is the node numbered k. `adjacent(node)` lists the neighbours of a node.
pub fn nested_dissection<'a>(
    position: &[[f64; 2]],
    adjacent: impl Fn(u32) -> &'a [u32],
) -> Vec<u32> {
    let n = position.len();
    let mut part: Vec<u32> = (0..n as u32).collect();
    // Which half of the present split a node is in: a stamp per split tells them apart from all others.
    let mut stamp = vec![0_u32; n];
    let mut order = vec![0_u32; n];
    let mut next_stamp = 0;
    // (start, end) of parts in `part`, each numbered from `start` on in `order`.
    let mut stack = vec![(0, n)];
    while let Some((start, end)) = stack.pop() {
        let nodes = &mut part[start..end];
        if nodes.len() <= LEAF {
            order[start..end].copy_from_slice(nodes);
            continue;
        }
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for &v in nodes.iter() {
            for k in 0..2 {
                low[k] = low[k].min(position[v as usize][k]);
                high[k] = high[k].max(position[v as usize][k]);
            }
        }
        let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
        let middle = nodes.len() / 2;
        nodes.select_nth_unstable_by(middle, |&a, &b| {
            position[a as usize][axis]
                .total_cmp(&position[b as usize][axis])
                .then(a.cmp(&b))
        });
        next_stamp += 1;
        for &v in &nodes[middle..] {
            stamp[v as usize] = next_stamp;
        }
        let (first, second) = nodes.split_at(middle);
        let (separator, inner): (Vec<u32>, Vec<u32>) = first
            .iter()
            .partition(|&&v| adjacent(v).iter().any(|&w| stamp[w as usize] == next_stamp));
        let second = second.to_vec();
        let (a, b) = (inner.len(), inner.len() + second.len());
        nodes[..a].copy_from_slice(&inner);
        nodes[a..b].copy_from_slice(&second);
        nodes[b..].copy_from_slice(&separator);
        order[start + b..end].copy_from_slice(&separator);
        for &v in &second {
            stamp[v as usize] = 0;
        }
        stack.push((start, start + a));
        stack.push((start + a, start + b));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_every_node_once_and_separators_last() {
        let m = 20;
        let position: Vec<[f64; 2]> = (0..m * m)
            .map(|k| [(k % m) as f64, (k / m) as f64])
            .collect();
        let neighbours: Vec<Vec<u32>> = (0..m * m)
            .map(|k| {
                let (i, j) = ((k % m) as i64, (k / m) as i64);
                let mut list = Vec::new();
                for (di, dj) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                    let (a, b) = (i + di, j + dj);
                    if (0..m as i64).contains(&a) && (0..m as i64).contains(&b) {
                        list.push((b * m as i64 + a) as u32);
                    }
                }
                list
            })
            .collect();
        let order = nested_dissection(&position, |v| &neighbours[v as usize]);
        let mut seen = order.clone();
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(k, v)| k as u32 == *v));
        // The last numbered nodes are one grid line.
        let last = &order[m * m - m..];
        let x = position[last[0] as usize][0];
        assert!(last.iter().all(|v| position[*v as usize][0] == x));
    }
}
