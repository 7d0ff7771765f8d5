#include "common/factor_graph/batch/batch.hpp"

#include <algorithm>
#include <cmath>

#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"

namespace understory::factor_graph::batch {
namespace {

constexpr double kLeastChi2 = 1e-12;  ///< Below, a perfect fit.
constexpr double kMaxDamping = 1e8;
constexpr double kLeastRadius = 1e-10;

/// The normal equations of a graph of constant structure.
class Equations {
 public:
  explicit Equations(graph::FactorGraph& graph) : graph_(graph) {
    for (int f = 0; f < graph.factor_capacity(); ++f) {
      if (graph.contains(graph::FactorId(f))) factors_.push_back(f);
    }
    for (int v = 0; v < graph.variable_capacity(); ++v) {
      columns_.push_back(graph::kNone);
      const graph::VariableRecord& variable = graph.variable(v);
      if (!variable.in_use || variable.degree == 0) continue;
      columns_.back() = hessian_.size;
      hessian_.size += dimension(variable.type);
      variables_.push_back(v);
    }
    find_pattern();
  }

  /// Linearises all factors at the estimates.
  void linearise() {
    for (const int v : variables_) graph_.rebase(v);
    std::fill(hessian_.values.begin(), hessian_.values.end(), 0.0);
    gradient_.setZero(hessian_.size);
    std::size_t slot = 0;
    for (const int f : factors_) {
      graph_.linearise(f);
      const graph::FactorRecord& factor = graph_.factor(f);
      const Eigen::Map<const Eigen::MatrixXd> j(factor.linear, factor.rows, factor.columns);
      const Eigen::Map<const Eigen::VectorXd> b(factor.linear + j.size(), factor.rows);
      const std::vector<int>& targets = targets_of(f);
      for (Eigen::Index a = 0; a < factor.columns; ++a) {
        gradient_[targets[static_cast<std::size_t>(a)]] -= j.col(a).dot(b);
        for (Eigen::Index c = 0; c <= a; ++c) {
          hessian_.values[slots_[slot++]] += j.col(a).dot(j.col(c));
        }
      }
    }
  }

  SymmetricSparse damped(double lambda) const {
    SymmetricSparse result = hessian_;
    for (int c = 0; c < result.size; ++c) {
      // The last entry of a column is its diagonal.
      const auto last = static_cast<std::size_t>(result.column_starts[c + 1] - 1);
      result.values[last] *= 1.0 + lambda;
    }
    return result;
  }

  Eigen::VectorXd times(const Eigen::VectorXd& x) const {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(hessian_.size);
    for (int c = 0; c < hessian_.size; ++c) {
      for (int k = hessian_.column_starts[c]; k < hessian_.column_starts[c + 1]; ++k) {
        const int r = hessian_.rows[k];
        y[r] += hessian_.values[k] * x[c];
        if (r != c) y[c] += hessian_.values[k] * x[r];
      }
    }
    return y;
  }

  /// Moves by `step` from the point of linearisation.
  void move(const Eigen::VectorXd& step) {
    for (const int v : variables_)
      graph_.move(v, step.data() + columns_[static_cast<std::size_t>(v)]);
  }

  int variable_at(int column) const {
    int found = variables_.front();
    for (const int v : variables_) {
      if (columns_[static_cast<std::size_t>(v)] <= column) found = v;
    }
    return found;
  }
  const SymmetricSparse& hessian() const { return hessian_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }

 private:
  const std::vector<int>& targets_of(int factor) {
    targets_.clear();
    for (const int v : graph_.variables_of(factor)) {
      const int size = dimension(graph_.variable(v).type);
      for (int k = 0; k < size; ++k) {
        targets_.push_back(columns_[static_cast<std::size_t>(v)] + k);
      }
    }
    return targets_;
  }

  void find_pattern() {
    std::vector<std::uint64_t> entries;
    const auto key = [](int a, int b) {
      return (static_cast<std::uint64_t>(std::max(a, b)) << 32U) |
             static_cast<std::uint64_t>(std::min(a, b));
    };

    // Each factor fills the lower triangle of its columns.
    for (const int f : factors_) {
      const std::vector<int>& targets = targets_of(f);
      for (std::size_t a = 0; a < targets.size(); ++a) {
        for (std::size_t c = 0; c <= a; ++c) entries.push_back(key(targets[a], targets[c]));
      }
    }

    std::vector<std::uint64_t> pattern = entries;
    std::sort(pattern.begin(), pattern.end());
    pattern.erase(std::unique(pattern.begin(), pattern.end()), pattern.end());

    // Convert counts per column to starts of the columns.
    hessian_.column_starts.assign(static_cast<std::size_t>(hessian_.size) + 1, 0);
    for (const std::uint64_t entry : pattern) {
      ++hessian_.column_starts[(entry >> 32U) + 1];
      hessian_.rows.push_back(static_cast<int>(entry & 0xffffffffU));
    }
    for (std::size_t c = 0; c < static_cast<std::size_t>(hessian_.size); ++c) {
      hessian_.column_starts[c + 1] += hessian_.column_starts[c];
    }

    // Each entry stores the place of its value.
    hessian_.values.resize(pattern.size());
    for (const std::uint64_t entry : entries) {
      slots_.push_back(static_cast<std::size_t>(
          std::lower_bound(pattern.begin(), pattern.end(), entry) - pattern.begin()));
    }
  }

  graph::FactorGraph& graph_;
  std::vector<int> factors_;
  std::vector<int> variables_;
  std::vector<int> columns_;  ///< First column of each variable; kNone without factors.
  std::vector<int> targets_;
  std::vector<std::size_t> slots_;
  SymmetricSparse hessian_;
  Eigen::VectorXd gradient_;
};

/// The path of Powell's dog leg, cut at the radius.
Eigen::VectorXd dog_leg(const Equations& equations, const Eigen::VectorXd& newton, double radius) {
  if (newton.norm() <= radius) return newton;
  const Eigen::VectorXd& g = equations.gradient();
  const Eigen::VectorXd cauchy = -g.squaredNorm() / g.dot(equations.times(g)) * g;
  if (cauchy.norm() >= radius) return radius / cauchy.norm() * cauchy;
  const Eigen::VectorXd leg = newton - cauchy;
  const double a = leg.squaredNorm();
  const double b = cauchy.dot(leg);
  const double c = cauchy.squaredNorm() - radius * radius;
  return cauchy + (-b + std::sqrt(b * b - a * c)) / a * leg;
}

}  // namespace

BatchReport optimise(graph::FactorGraph& graph, const BatchParameters& parameters) {
  BatchReport report;
  report.chi2 = graph.chi2();
  Equations equations(graph);
  SparseCholesky cholesky;
  const bool is_marquardt = parameters.method == BatchMethod::kLevenbergMarquardt;
  double damping = is_marquardt ? parameters.first_damping : 0.0;
  double radius = parameters.first_radius;

  bool is_fresh = false;
  Eigen::VectorXd newton;
  const Eigen::VectorXd nothing = Eigen::VectorXd::Zero(equations.hessian().size);
  if (nothing.size() == 0) {
    report.ok = report.converged = true;
    return report;
  }

  while (report.iterations < parameters.max_iterations && !report.converged) {
    if (!is_fresh) equations.linearise();
    if (!is_fresh || is_marquardt) {
      const int bad = damping > 0.0 ? cholesky.factorise(equations.damped(damping))
                                    : cholesky.factorise(equations.hessian());
      if (bad >= 0) {
        report.undetermined.push_back(graph::VariableId(equations.variable_at(bad)));
        report.error = bayes_tree::name_of(graph, report.undetermined.back()) +
                       " is not determined by the measurements";
        return report;
      }
      newton = -cholesky.solve(equations.gradient());
    }

    is_fresh = true;
    ++report.iterations;
    const Eigen::VectorXd step =
        parameters.method == BatchMethod::kDogleg ? dog_leg(equations, newton, radius) : newton;
    equations.move(step);

    const double chi2 = graph.chi2();
    const double decrease = report.chi2 - chi2;
    const bool is_flat =
        std::abs(decrease) <= parameters.relative_decrease * report.chi2 || chi2 < kLeastChi2;
    if (decrease >= 0.0 || parameters.method == BatchMethod::kGaussNewton) {
      report.chi2 = chi2;
      report.converged = is_flat;
      is_fresh = false;
      damping *= 0.1;
      if (step.norm() > 0.9 * radius) radius *= 3.0;
      continue;
    }

    equations.move(nothing);
    report.converged = is_flat;
    damping = std::max(10.0 * damping, parameters.first_damping);
    radius = 0.25 * std::min(radius, step.norm());
    if (is_marquardt ? damping > kMaxDamping : radius < kLeastRadius) break;
  }

  report.ok = std::isfinite(report.chi2);
  return report;
}

SymmetricSparse hessian_of(graph::FactorGraph& graph) {
  Equations equations(graph);
  equations.linearise();
  return equations.hessian();
}

}  // namespace understory::factor_graph::batch
