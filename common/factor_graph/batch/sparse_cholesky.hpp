// CHOLMOD, without its headers.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace understory::factor_graph::batch {

/// A symmetric positive definite matrix in compressed columns, upper triangle.
struct SymmetricSparse {
  int size = 0;                    ///< Rows and columns.
  std::vector<int> column_starts;  ///< size + 1
  std::vector<int> rows;           ///< Sorted in each column, row <= column.
  std::vector<double> values;      ///< Like `rows`.
};

/// Cholesky factorisation with a fill-reducing ordering. Single-threaded and deterministic.
class SparseCholesky {
 public:
  SparseCholesky();
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  /// The ordering is reused while the pattern stays the same. Returns -1, or the column at which
  /// the matrix is not positive definite.
  int factorise(const SymmetricSparse& matrix);
  /// Solves for one or more right-hand sides; after a successful factorise().
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::factor_graph::batch
