use super::*;
use crate::math::sequence;

/// Splits nodes one after the other, the largest error first, of equal ones the older.
fn one_by_one(strata: &mut Strata, count: usize) {
    while strata.clusters().len() < count {
        let leaves = (0..strata.nodes.len()).filter(|&node| strata.nodes[node].split.is_none());
        let error = |node: &usize| strata.nodes[*node].cluster.error();
        let largest = leaves.max_by(|a, b| error(a).total_cmp(&error(b)).then(b.cmp(a)));
        strata.split(largest.unwrap());
    }
}

#[test]
fn what_is_split_ahead_is_what_is_split_in_its_turn() {
    let random = |i: usize, d: u32| sequence::sample(i as u32, d, 7);
    // Every third lies where another one does: clusters at one place are split in number.
    let place = |i: usize| -> Place { std::array::from_fn(|d| random(i - i % 3 / 2, d as u32)) };
    let places: Vec<Place> = (0..9000).map(place).collect();
    let weights: Vec<f64> = (0..9000).map(|i| f64::from(random(i, 6)).powi(3)).collect();
    for count in [1, 2, 300, 2000] {
        let ahead = Strata::new(&places, &weights, (count, None), &[]);
        let mut in_turn = Strata::new(&places, &weights, (1, None), &[]);
        one_by_one(&mut in_turn, count as usize);
        let all = |strata: &Strata| -> Vec<(u64, Vec<u32>, f64)> {
            let items = |cluster: &Cluster| cluster.items.iter().map(|item| item.index).collect();
            strata.clusters().into_iter().map(|(id, c)| (id, items(c), c.radius_squared)).collect()
        };
        assert_eq!(all(&ahead).len(), count as usize);
        assert!(all(&ahead) == all(&in_turn), "{count}");
    }
}
