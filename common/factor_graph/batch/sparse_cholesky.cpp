#include "common/factor_graph/batch/sparse_cholesky.hpp"

#include <cholmod.h>
#include <omp.h>

#include <mutex>
#include <stdexcept>
#include <utility>

namespace understory::factor_graph::batch {

struct SparseCholesky::Impl {
  cholmod_common common{};
  cholmod_factor* factor = nullptr;
  std::vector<int> starts;  ///< Pattern of the analysed matrix.
  std::vector<int> rows;

  Impl() {
    // CHOLMOD requests four OpenMP threads on any computer; results must not depend on threads, and
    // other processes need the cores.
    omp_set_max_active_levels(0);
    cholmod_start(&common);
    common.print = 0;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_AMD;
    common.postorder = 1;
  }
  ~Impl() {
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
};

namespace {

/// Debian's single-threaded OpenBLAS uses its scratch memory without locks: two parallel
/// factorisations give wrong numbers. Only experiments run several in one process.
std::mutex& blas_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// A view for CHOLMOD; it does not write through it.
cholmod_sparse view(const SymmetricSparse& matrix) {
  cholmod_sparse sparse{};
  sparse.nrow = sparse.ncol = static_cast<std::size_t>(matrix.size);
  sparse.nzmax = matrix.rows.size();
  sparse.p = const_cast<int*>(matrix.column_starts.data());
  sparse.i = const_cast<int*>(matrix.rows.data());
  sparse.x = const_cast<double*>(matrix.values.data());
  sparse.stype = 1;
  sparse.itype = CHOLMOD_INT;
  sparse.xtype = CHOLMOD_REAL;
  sparse.dtype = CHOLMOD_DOUBLE;
  sparse.sorted = 1;
  sparse.packed = 1;
  return sparse;
}

}  // namespace

SparseCholesky::SparseCholesky() : impl_(std::make_unique<Impl>()) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

int SparseCholesky::factorise(const SymmetricSparse& matrix) {
  const std::lock_guard lock(blas_mutex());
  cholmod_sparse sparse = view(matrix);
  Impl& impl = *impl_;
  if (impl.factor == nullptr || impl.starts != matrix.column_starts || impl.rows != matrix.rows) {
    cholmod_free_factor(&impl.factor, &impl.common);
    impl.factor = cholmod_analyze(&sparse, &impl.common);
    if (impl.factor == nullptr) throw std::runtime_error("CHOLMOD: analysis failed");
    impl.starts = matrix.column_starts;
    impl.rows = matrix.rows;
  }

  cholmod_factorize(&sparse, impl.factor, &impl.common);
  if (impl.common.status < CHOLMOD_OK) throw std::runtime_error("CHOLMOD: factorisation failed");
  if (impl.factor->minor < impl.factor->n) {
    return static_cast<int*>(impl.factor->Perm)[impl.factor->minor];
  }
  return -1;
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::MatrixXd& right) const {
  const std::lock_guard lock(blas_mutex());
  cholmod_dense dense{};
  dense.nrow = static_cast<std::size_t>(right.rows());
  dense.ncol = static_cast<std::size_t>(right.cols());
  dense.nzmax = static_cast<std::size_t>(right.size());
  dense.d = dense.nrow;
  dense.x = const_cast<double*>(right.data());
  dense.xtype = CHOLMOD_REAL;
  dense.dtype = CHOLMOD_DOUBLE;

  cholmod_dense* solution = cholmod_solve(CHOLMOD_A, impl_->factor, &dense, &impl_->common);
  if (solution == nullptr) throw std::runtime_error("CHOLMOD: solve failed");

  Eigen::MatrixXd result = Eigen::Map<const Eigen::MatrixXd>(
      static_cast<const double*>(solution->x), right.rows(), right.cols());
  cholmod_free_dense(&solution, &impl_->common);
  return result;
}

}  // namespace understory::factor_graph::batch
