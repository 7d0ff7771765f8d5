#include "common/factor_graph/graph/factor_graph.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace understory::factor_graph::graph {
namespace {

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(std::string("factor graph: ") + what);
}

void require_finite(const Value& initial) {
  for (const double number : initial)
    require(std::isfinite(number), "an initial estimate is not finite");
}

/// R with R' R = information; also for a singular information.
Eigen::MatrixXd root_of(const Eigen::Ref<const Eigen::MatrixXd>& information) {
  require(information.allFinite(), "an information matrix is not finite");
  const double size = information.cwiseAbs().maxCoeff();
  require((information - information.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * size,
          "an information matrix is not symmetric");
  const Eigen::LLT<Eigen::MatrixXd> cholesky(information);
  if (cholesky.info() == Eigen::Success) return cholesky.matrixU();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  require(eigen.eigenvalues().minCoeff() >= -1e-9 * size,
          "an information matrix is not positive semi-definite");
  return eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

FactorGraph::FactorGraph() { links_ = storage::BlockPool<int>(); }

VariableId FactorGraph::add(VariableType type, const Value& initial) {
  require_finite(initial);
  const int id = variables_.add();
  VariableRecord& record = variables_.edit(id);
  record.type = type;
  record.in_use = true;
  record.base = record.value = initial;
  return VariableId(id);
}

void FactorGraph::restart(int id, const Value& initial) {
  require(variables_[id].degree == 0, "a variable that has factors cannot be restarted");
  require_finite(initial);
  VariableRecord& record = variables_.edit(id);
  record.base = record.value = initial;
  record.delta = record.judged = Delta{};
  record.scale = {};
  record.rotated = 0.0;
  record.is_curved = false;
}

void FactorGraph::renew_scale(int id) {
  variables_.edit(id).scale = {};
  for (int i = variables_[id].first_incidence; i != kNone; i = incidences_[i].next) {
    const int factor = incidences_[i].factor;
    if (factors_[factor].linear != nullptr) keep_scales(factors_[factor], variables_of(factor));
  }
}

bool FactorGraph::contains(VariableId id) const {
  return index(id) >= 0 && index(id) < variables_.size() && variables_[index(id)].in_use;
}

bool FactorGraph::contains(FactorId id) const {
  return index(id) >= 0 && index(id) < factors_.size() && factors_[index(id)].in_use;
}

std::span<const int> FactorGraph::incidences_of(int factor) const {
  const FactorRecord& record = factors_[factor];
  const auto count = static_cast<std::size_t>(record.variable_count);
  if (record.many_links != nullptr) return {record.many_links + count, count};
  return {record.few_incidences.data(), count};
}

std::span<const double> FactorGraph::measurement(FactorId id) const {
  const FactorRecord& record = factors_[index(id)];
  return {record.data, static_cast<std::size_t>(record.measurement_size)};
}

Eigen::MatrixXd FactorGraph::information(FactorId id) const {
  const FactorRecord& record = factors_[index(id)];
  const Eigen::Map<const Eigen::MatrixXd> root(record.data + record.measurement_size, record.rows,
                                               record.rows);
  return root.transpose() * root;
}

void FactorGraph::check_types(FactorKind kind, std::span<const VariableId> variables) const {
  require(!variables.empty(), "a factor without variables");
  for (std::size_t i = 0; i < variables.size(); ++i) {
    require(contains(variables[i]), "a factor of a variable that does not exist");
    for (std::size_t k = 0; k < i; ++k) {
      require(variables[k] != variables[i], "a factor names a variable twice");
    }
  }

  const std::span<const VariableType> wanted = variable_types(kind);
  if (wanted.empty()) return;
  require(variables.size() == wanted.size() || kind == FactorKind::kCondensed2,
          "a factor with too many or too few variables");
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    require(type(variables[i]) == wanted[i], "a factor's variable is of the wrong type");
  }
}

int FactorGraph::link(FactorKind kind, const Loss& loss, std::span<const VariableId> variables) {
  check_types(kind, variables);
  const int id = factors_.add();
  FactorRecord& record = factors_.edit(id);
  record.kind = kind;
  record.in_use = true;
  record.kernel = loss.kernel;
  record.loss_width = loss.width;
  record.variable_count = static_cast<int>(variables.size());

  variables_of_.resize(static_cast<std::size_t>(factors_.size()));
  std::array<int, 2>& few = variables_of_[static_cast<std::size_t>(id)];
  few = {kNone, kNone};
  int* names = few.data();
  int* incidences = record.few_incidences.data();
  if (variables.size() > 2) {
    record.many_links = links_.take(2 * variables.size());
    names = record.many_links;
    incidences = names + variables.size();
  }

  for (std::size_t i = 0; i < variables.size(); ++i) {
    const int name = index(variables[i]);
    const int incidence = incidences_.add();
    VariableRecord& variable = variables_.edit(name);
    incidences_.edit(incidence) = {id, name, variable.first_incidence, kNone};
    if (variable.first_incidence != kNone) {
      incidences_.edit(variable.first_incidence).previous = incidence;
    }
    variable.first_incidence = incidence;
    ++variable.degree;
    record.columns += dimension(variable.type);
    names[i] = name;
    incidences[i] = incidence;
  }
  return id;
}

void FactorGraph::mark_curved(int factor) {
  for (const int name : variables_of(factor)) variables_.edit(name).is_curved = true;
}

void FactorGraph::store_data(int factor, std::span<const double> measurement,
                             const Eigen::Ref<const Eigen::MatrixXd>& information) {
  FactorRecord& record = factors_.edit(factor);
  const Eigen::MatrixXd root = root_of(information);
  record.rows = static_cast<int>(root.rows());
  record.measurement_size = static_cast<int>(measurement.size());
  record.data_size = record.measurement_size + static_cast<int>(root.size());
  record.data = pool_.take(static_cast<std::size_t>(record.data_size));
  std::copy(measurement.begin(), measurement.end(), record.data);
  std::copy_n(root.data(), root.size(), record.data + record.measurement_size);
}

FactorId FactorGraph::add(const Factor& factor) {
  const int rows = residual_dimension(factor.kind);
  require(rows > 0 && factor.information.rows() == rows && factor.information.cols() == rows,
          "an information matrix of the wrong size");
  for (const double number : factor.measurement) {
    require(std::isfinite(number), "a measurement is not finite");
  }

  const Eigen::MatrixXd information = factor.information;
  root_of(information);
  const int id = link(factor.kind, factor.loss,
                      {factor.variables.data(), static_cast<std::size_t>(factor.variable_count)});
  if (factor.kind == FactorKind::kRangeBearing2 || factor.loss.kernel != RobustKernel::kNone) {
    mark_curved(id);
  }

  // Nearly all factors of a map are observations in the plane, with two numbers.
  const std::span<const double> measurement(factor.measurement);
  store_data(id, factor.kind == FactorKind::kPoint2 ? measurement.first(2) : measurement,
             information);
  linearise(id);
  return FactorId(id);
}

FactorId FactorGraph::add(const CondensedFactor& factor) {
  require(factor.variables.size() >= 2, "a condensed measurement needs two variables");
  check_types(FactorKind::kCondensed2, factor.variables);
  int rows = 0;
  for (std::size_t i = 1; i < factor.variables.size(); ++i) {
    const VariableType one = type(factor.variables[i]);
    require(one == VariableType::kPose2 || one == VariableType::kPoint2,
            "a condensed measurement is of poses and points of the plane");
    rows += dimension(one);
  }
  require(factor.measurement.size() == rows && factor.information.rows() == rows &&
              factor.information.cols() == rows && factor.measurement.allFinite(),
          "a condensed measurement of the wrong size");
  root_of(factor.information);

  const int id = link(FactorKind::kCondensed2, factor.loss, factor.variables);
  if (factor.loss.kernel != RobustKernel::kNone) mark_curved(id);
  store_data(id, {factor.measurement.data(), static_cast<std::size_t>(rows)}, factor.information);
  linearise(id);
  return FactorId(id);
}

FactorId FactorGraph::add(std::shared_ptr<const UserFactor> factor,
                          std::span<const VariableId> variables) {
  require(factor != nullptr && factor->residual_dimension() > 0, "a user's factor without rows");
  const int id = link(FactorKind::kUser, {}, variables);
  mark_curved(id);
  FactorRecord& record = factors_.edit(id);
  record.rows = factor->residual_dimension();
  if (free_users_.empty()) {
    free_users_.push_back(static_cast<int>(users_.size()));
    users_.emplace_back();
  }

  record.user = free_users_.back();
  free_users_.pop_back();
  users_[static_cast<std::size_t>(record.user)] = std::move(factor);
  linearise(id);
  return FactorId(id);
}

FactorId FactorGraph::add_linear(std::span<const VariableId> variables,
                                 const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& right) {
  check_types(FactorKind::kLinear, variables);
  int columns = 0;
  for (const VariableId id : variables) columns += dimension(type(id));
  require(jacobian.rows() > 0 && jacobian.cols() == columns && right.size() == jacobian.rows() &&
              jacobian.allFinite() && right.allFinite(),
          "a linear factor of the wrong size");

  const int id = link(FactorKind::kLinear, {}, variables);
  FactorRecord& record = factors_.edit(id);
  record.rows = static_cast<int>(jacobian.rows());
  const auto values = variables.size() * std::tuple_size_v<Value>;
  record.measurement_size = static_cast<int>(values);
  record.data_size = static_cast<int>(values) + record.rows * (columns + 1);
  record.data = pool_.take(static_cast<std::size_t>(record.data_size));

  double* out = record.data;
  for (const VariableId one : variables)
    out = std::copy_n(value(one).data(), value(one).size(), out);
  out = std::copy_n(jacobian.data(), jacobian.size(), out);
  std::copy_n(right.data(), right.size(), out);
  linearise(id);
  return FactorId(id);
}

void FactorGraph::remove(FactorId id) {
  require(contains(id), "removal of a factor that does not exist");
  for (const int incidence : incidences_of(index(id))) {
    const IncidenceRecord record = incidences_[incidence];
    VariableRecord& variable = variables_.edit(record.variable);
    --variable.degree;
    if (record.previous == kNone) {
      variable.first_incidence = record.next;
    } else {
      incidences_.edit(record.previous).next = record.next;
    }
    if (record.next != kNone) incidences_.edit(record.next).previous = record.previous;
    incidences_.remove(incidence);
  }

  factors_.edit(index(id)).in_use = false;
  factors_.remove(index(id));
  std::array<int, 2>& few = variables_of_[static_cast<std::size_t>(index(id))];
  removed_.push_back({index(id), few});
  few = {kNone, kNone};
}

void FactorGraph::remove(VariableId id) {
  require(contains(id), "removal of a variable that does not exist");
  require(variable(index(id)).degree == 0, "removal of a variable that still has factors");
  variables_.edit(index(id)).in_use = false;
  variables_.remove(index(id));
}

void FactorGraph::free_blocks(const FactorRecord& factor) {
  if (factor.data != nullptr) {
    pool_.give_back(factor.data, static_cast<std::size_t>(factor.data_size));
  }
  if (factor.many_links != nullptr) {
    links_.give_back(factor.many_links, 2 * static_cast<std::size_t>(factor.variable_count));
  }
  if (factor.user != kNone) {
    users_[static_cast<std::size_t>(factor.user)].reset();
    free_users_.push_back(factor.user);
  }
}

namespace {
std::size_t linear_size(const FactorRecord& factor) {
  return static_cast<std::size_t>(factor.rows) * static_cast<std::size_t>(factor.columns + 1) + 4;
}
}  // namespace

void FactorGraph::commit() {
  factors_.commit(
      [&](const FactorRecord& gone) {
        free_blocks(gone);
        if (gone.linear != nullptr) pool_.give_back(gone.linear, linear_size(gone));
      },
      [&](const FactorRecord& before, const FactorRecord& now) {
        if (before.linear != nullptr && before.linear != now.linear) {
          pool_.give_back(before.linear, linear_size(before));
        }
      });
  removed_.clear();
  incidences_.commit([](const auto&) {}, [](const auto&, const auto&) {});
  variables_.commit([](const auto&) {}, [](const auto&, const auto&) {});
}

void FactorGraph::rollback() {
  for (const Removed& one : removed_) variables_of_[static_cast<std::size_t>(one.factor)] = one.few;
  removed_.clear();
  factors_.rollback(
      [&](int, const FactorRecord& now, const FactorRecord& before) {
        if (now.linear != before.linear) pool_.give_back(now.linear, linear_size(now));
      },
      [&](int id, const FactorRecord& gone) {
        variables_of_[static_cast<std::size_t>(id)] = {kNone, kNone};
        free_blocks(gone);
        if (gone.linear != nullptr) pool_.give_back(gone.linear, linear_size(gone));
      });
  incidences_.rollback([](int, const auto&, const auto&) {}, [](int, const auto&) {});
  variables_.rollback([](int, const auto&, const auto&) {}, [](int, const auto&) {});
}

}  // namespace understory::factor_graph::graph
