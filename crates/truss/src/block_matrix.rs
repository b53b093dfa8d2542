//! Products of a matrix and a vector, the same to the last bit on all machines.

use nalgebra::DMatrix;

use crate::vectorised::vectorised;

/// Rows of a block.
pub(crate) const LANES: usize = 8;

/// One number for each row of a block.
pub(crate) type Block = [f64; LANES];

/// Running sums of a product. The columns are dealt out to them by number, so that no sum waits for the one before, and
/// further columns that are multiplied by zero change no bit.
const SUMS: usize = 4;

/// A matrix stored in blocks of eight rows, in the order in which a product reads them: the inner loop runs over
/// independent rows, and vectorises without reordering any sum.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct BlockMatrix {
    rows: usize,
    columns: usize,
    /// For each block of rows, its columns.
    blocks: Vec<Block>,
}

impl BlockMatrix {
    /// The same matrix in blocks.
    #[must_use]
    pub fn new(matrix: &DMatrix<f64>) -> Self {
        let (rows, columns) = matrix.shape();
        Self::from_fn(rows, columns, |row, column| matrix[(row, column)])
    }

    pub(crate) fn from_fn(
        rows: usize,
        columns: usize,
        value: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let entry = |row, column| if row < rows { value(row, column) } else { 0.0 };
        let places = (0..rows.div_ceil(LANES))
            .flat_map(|block| (0..columns).map(move |column| (block, column)));
        let blocks = places
            .map(|(block, column)| std::array::from_fn(|lane| entry(block * LANES + lane, column)));
        Self { rows, columns, blocks: blocks.collect() }
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// `out` += matrix · `vector`. Entries of the vector beyond the columns do not count, missing ones count as zero.
    pub fn add_product(&self, vector: &[f64], out: &mut [f64]) {
        vectorised(
            #[inline(always)]
            || self.add(vector, out),
        );
    }

    #[inline(always)]
    fn add(&self, vector: &[f64], out: &mut [f64]) {
        let blocks = 0..self.rows.div_ceil(LANES);
        for (block, out) in blocks.zip(out.chunks_mut(LANES)) {
            let product = self.block_product(block, vector);
            if let Some(out) = out.first_chunk_mut::<LANES>() {
                for lane in 0..LANES {
                    out[lane] += product[lane];
                }
            } else {
                for (value, sum) in out.iter_mut().zip(product) {
                    *value += sum;
                }
            }
        }
    }

    /// The product of a block of rows.
    #[inline(always)]
    pub(crate) fn block_product(&self, block: usize, vector: &[f64]) -> Block {
        let columns = &self.blocks[block * self.columns..][..self.columns];
        let (groups, rest) = columns.as_chunks::<SUMS>();
        let (factors, rest_factors) =
            vector.get(..self.columns).unwrap_or(vector).as_chunks::<SUMS>();
        let mut sums = [[0.0; LANES]; SUMS];
        for (group, factors) in groups.iter().zip(factors) {
            for sum in 0..SUMS {
                add_scaled(&mut sums[sum], &group[sum], factors[sum]);
            }
        }
        for (sum, (column, factor)) in sums.iter_mut().zip(rest.iter().zip(rest_factors)) {
            add_scaled(sum, column, *factor);
        }
        let mut product = [0.0; LANES];
        for (lane, product) in product.iter_mut().enumerate() {
            *product = (sums[0][lane] + sums[1][lane]) + (sums[2][lane] + sums[3][lane]);
        }
        product
    }
}

#[inline(always)]
fn add_scaled(sum: &mut Block, column: &Block, factor: f64) {
    for (sum, entry) in sum.iter_mut().zip(column) {
        *sum = entry.mul_add(factor, *sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_of_any_shape_is_that_of_its_definition() {
        for (rows, columns) in [(1, 1), (3, 2), (8, 4), (9, 5), (18, 72), (0, 3), (3, 0)] {
            let matrix = DMatrix::from_fn(rows, columns, |r, c| (1.3 * r as f64 + c as f64).sin());
            let vector: Vec<f64> = (0..columns).map(|c| (0.7 * c as f64).cos()).collect();
            let mut out = vec![1.0; rows];
            BlockMatrix::new(&matrix).add_product(&vector, &mut out);
            for (row, found) in out.iter().enumerate() {
                let sum: f64 = (0..columns).map(|c| matrix[(row, c)] * vector[c]).sum();
                assert!((found - 1.0 - sum).abs() < 1e-13, "{rows} × {columns}: {found} {sum}");
            }
        }
    }

    #[test]
    fn further_columns_times_zero_change_no_bit() {
        let entry = |row: usize, column: usize| (1.7 * row as f64 + 0.3 * column as f64).sin();
        let vector: Vec<f64> = (0..7).map(|column| (column as f64).cos()).collect();
        for columns in 1..7 {
            let products = [columns, 7].map(|all| {
                let mut factors = vector[..all].to_vec();
                factors[columns..].fill(0.0);
                let mut out = [0.0; 5];
                BlockMatrix::new(&DMatrix::from_fn(5, all, entry)).add_product(&factors, &mut out);
                out
            });
            assert_eq!(products[0], products[1], "{columns}");
        }
    }

    #[test]
    fn what_is_longer_than_the_matrix_is_left_alone_and_what_is_missing_is_zero() {
        let matrix = BlockMatrix::new(&DMatrix::from_element(2, 3, 1.0));
        let mut out = [0.0; 4];
        matrix.add_product(&[1.0, 2.0, 3.0, 99.0, 99.0], &mut out);
        assert_eq!(out, [6.0, 6.0, 0.0, 0.0]);
        matrix.add_product(&[1.0], &mut out);
        assert_eq!(out, [7.0, 7.0, 0.0, 0.0]);
    }
}
