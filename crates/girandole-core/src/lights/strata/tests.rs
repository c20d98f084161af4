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

#[test]
fn strata_that_count_for_more_are_not_merged_into_others() {
    let place = |i: usize| -> Place {
        let random = |d: u32| sequence::sample(i as u32, d, 3);
        [random(0) + if i.is_multiple_of(4) { 10.0 } else { 0.0 }, random(1), random(2), 0.0, 0.0, 0.0]
    };
    let places: Vec<Place> = (0..4000).map(place).collect();
    // Those apart have a tenth of the weight that would give them a quarter of the strata.
    let mut weights: Vec<f64> =
        (0..4000_usize).map(|i| if i.is_multiple_of(4) { 0.1 } else { 1.0 }).collect();
    let count = |strata: &Strata| {
        strata.clusters().iter().filter(|(_, cluster)| cluster.items[0].at[0] > 5.0).count()
    };
    for (growth, stays) in [(Growth::Balanced, true), (Growth::Held, true), (Growth::AtLeast, false)] {
        let apart = Apart { axis: 0, border: 5.0, count: 40, growth };
        let mut strata = Strata::new(&places, &weights, (100, None), &[apart]);
        assert_eq!((count(&strata), strata.clusters().len()), (40, 100));
        let now = weights.clone();
        strata.rebalance(100, &places, &mut weights, &now);
        let left = count(&strata);
        assert_eq!((35..=45).contains(&left), stays, "{growth:?}: {left}");
        // Where they come to bring nothing, others get theirs, unless they are held.
        let dark: Vec<f64> =
            now.iter().enumerate().map(|(i, w)| if i.is_multiple_of(4) { 1e-4 } else { *w }).collect();
        strata.rebalance(100, &places, &mut weights.clone(), &dark);
        assert_eq!(count(&strata) < 15, growth != Growth::Held, "{growth:?}: {}", count(&strata));
    }
}
