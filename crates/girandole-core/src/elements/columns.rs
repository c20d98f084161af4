//! How many lights an element has in common with each of many others, counted for a block of them at once.
//!
//! Each light has a column: a bit for each element, set if it has that light. The columns of a set's lights are added
//! up in binary; plane i holds bit i of each element's sum (vertical counters, with carry-save adders for the low
//! bits). A light takes a few operations on whole words, where counting the common bits of two sets takes dozens for
//! each pair.
//!
//! Worked example: for the set {0, 2} and three elements with the lights {0, 1}, {0, 2} and {1}, the columns are 110 of
//! light 0 and 010 of light 2. Their sum has the planes 100 (ones) and 010 (twos): one, two and no common lights.

use std::ops::Range;

/// Words that are processed at once: two fill the SIMD registers that every x86-64 and ARM64 processor has.
const LANES: usize = 2;
/// Elements in a block.
pub(super) const BLOCK: usize = LANES * u64::BITS as usize;

/// A bit for each element of a block.
type Bits = [u64; LANES];

const ZERO: Bits = [0; LANES];

/// Sets of lights by columns. Elements are in blocks of [`BLOCK`], in the order in which they were pushed.
#[derive(Debug)]
pub(super) struct Columns {
    lights: usize,
    /// Planes of `needs`.
    need_planes: usize,
    len: usize,
    /// For each block, a column for each light.
    sets: Vec<Bits>,
    /// For each block, the planes of a number that goes with each element.
    needs: Vec<Bits>,
    /// For each block, which of its elements are not removed.
    present: Vec<Bits>,
}

impl Columns {
    /// No elements yet, of so many lights, and with needs up to `most`.
    pub(super) fn new(lights: usize, most: u32) -> Self {
        let need_planes = bit_length(most);
        let (sets, needs, present) = (Vec::new(), Vec::new(), Vec::new());
        Self { lights, need_planes, len: 0, sets, needs, present }
    }

    /// The same without elements.
    pub(super) fn emptied(&self) -> Self {
        let (sets, needs, present) = (Vec::new(), Vec::new(), Vec::new());
        Self { len: 0, sets, needs, present, ..*self }
    }

    /// Adds an element, with the least number of common lights that a pair with it needs.
    pub(super) fn push(&mut self, lights: &[u32], need: u32) {
        let (block, at) = (self.len / BLOCK, self.len % BLOCK);
        if at == 0 {
            self.sets.resize((block + 1) * self.lights, ZERO);
            self.needs.resize((block + 1) * self.need_planes, ZERO);
            self.present.push(ZERO);
        }
        let set_bit = |bits: &mut Bits| bits[at / 64] |= 1 << (at % 64);
        for &light in lights {
            set_bit(&mut self.sets[block * self.lights + light as usize]);
        }
        for plane in (0..self.need_planes).filter(|plane| need >> plane & 1 != 0) {
            set_bit(&mut self.needs[block * self.need_planes + plane]);
        }
        set_bit(&mut self.present[block]);
        self.len += 1;
    }

    /// Leaves an element out from now on; the others keep their places.
    pub(super) fn remove(&mut self, at: usize) {
        self.present[at / BLOCK][at % BLOCK / 64] &= !(1 << (at % 64));
    }

    /// Counts how many lights the elements of a block have in common with a set of lights.
    pub(super) fn count(&self, block: usize, lights: &[u32], counts: &mut Counts) {
        let len = bit_length(lights.len() as u32).max(self.need_planes).max(3);
        let sets = &self.sets[block * self.lights..(block + 1) * self.lights];
        let column = |light: u32| sets[light as usize];
        counts.planes.clear();
        counts.planes.resize(len, ZERO);
        let [ones_out, twos_out, fours_out, more @ ..] = &mut counts.planes[..] else { return };
        let (mut ones, mut twos, mut fours) = (ZERO, ZERO, ZERO);
        let (eights, rest) = lights.as_chunks::<8>();
        for &[a, b, c, d, e, f, g, h] in eights {
            let t0 = add(&mut ones, column(a), column(b));
            let t1 = add(&mut ones, column(c), column(d));
            let f0 = add(&mut twos, t0, t1);
            let t0 = add(&mut ones, column(e), column(f));
            let t1 = add(&mut ones, column(g), column(h));
            let f1 = add(&mut twos, t0, t1);
            add_all(more, add(&mut fours, f0, f1));
        }
        for &light in rest {
            let carry = add(&mut ones, column(light), ZERO);
            let carry = add(&mut twos, carry, ZERO);
            add_all(more, add(&mut fours, carry, ZERO));
        }
        (*ones_out, *twos_out, *fours_out) = (ones, twos, fours);
    }

    /// The elements of a block, of those `within` it, whose counts are at least `least`, and also at least their own
    /// needs plus `extra`.
    pub(super) fn candidates(
        &self,
        block: usize,
        counts: &Counts,
        least: u32,
        extra: u32,
        within: Range<usize>,
    ) -> Candidates {
        let mut bits = self.present[block];
        for (lane, bits) in bits.iter_mut().enumerate() {
            let below = |end: usize| match end.saturating_sub(lane * 64) {
                end @ ..64 => (1 << end) - 1,
                _ => u64::MAX,
            };
            *bits &= below(within.end) & !below(within.start);
        }
        bits = and(bits, counts.at_least(least, &[]));
        if bits != ZERO {
            let needs = &self.needs[block * self.need_planes..(block + 1) * self.need_planes];
            bits = and(bits, counts.at_least(extra, needs));
        }
        Candidates(bits)
    }
}

/// A number for each element of a block.
#[derive(Default)]
pub(super) struct Counts {
    planes: Vec<Bits>,
}

impl Counts {
    /// The number of one of the elements.
    pub(super) fn get(&self, at: usize) -> u32 {
        let bit = |plane: &Bits| (plane[at / 64] >> (at % 64)) as u32 & 1;
        self.planes.iter().rev().fold(0, |number, plane| number << 1 | bit(plane))
    }

    /// Where the number is at least a constant plus another number, which is given in planes.
    fn at_least(&self, constant: u32, other: &[Bits]) -> Bits {
        if bit_length(constant) > self.planes.len() {
            return ZERO;
        }
        let (mut borrow, mut other_borrow) = (ZERO, ZERO);
        for (i, plane) in self.planes.iter().enumerate() {
            let digit = if constant >> i & 1 != 0 { !0 } else { 0 };
            let other = other.get(i).unwrap_or(&ZERO);
            for lane in 0..LANES {
                let left = plane[lane] ^ digit ^ borrow[lane];
                borrow[lane] = !plane[lane] & (digit | borrow[lane]) | digit & borrow[lane];
                let taken = other[lane] | other_borrow[lane];
                other_borrow[lane] = !left & taken | other[lane] & other_borrow[lane];
            }
        }
        std::array::from_fn(|lane| !(borrow[lane] | other_borrow[lane]))
    }
}

/// Places in a block, in ascending order.
pub(super) struct Candidates(Bits);

impl Iterator for Candidates {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let (lane, word) = self.0.iter_mut().enumerate().find(|(_, word)| **word != 0)?;
        let at = word.trailing_zeros() as usize;
        *word &= *word - 1;
        Some(lane * 64 + at)
    }
}

/// How many binary digits a number has.
fn bit_length(number: u32) -> usize {
    (u32::BITS - number.leading_zeros()) as usize
}

fn and(a: Bits, b: Bits) -> Bits {
    std::array::from_fn(|lane| a[lane] & b[lane])
}

/// Adds two digits to a third and gives the carry.
#[inline]
fn add(sum: &mut Bits, a: Bits, b: Bits) -> Bits {
    std::array::from_fn(|lane| {
        let half = sum[lane] ^ a[lane];
        let carry = sum[lane] & a[lane] | half & b[lane];
        sum[lane] = half ^ b[lane];
        carry
    })
}

/// Adds a digit to numbers.
#[inline]
fn add_all(planes: &mut [Bits], mut carry: Bits) {
    for plane in planes {
        carry = add(plane, carry, ZERO);
    }
}
