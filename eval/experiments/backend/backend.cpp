#include "eval/experiments/backend/backend.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/bayes_tree/incremental_smoother.hpp"
#include "common/factor_graph/files/graph_file.hpp"
#include "common/io/text_file.hpp"
#include "common/terminal/printable.hpp"
#include "eval/tools/memory.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::experiments::backend {
namespace {

/// The first pose is held fast by a prior that no other factor comes near.
constexpr double kFixed = 1e8;

/// The line is 0 where the fault is in none in particular.
[[noreturn]] void refuse(const std::filesystem::path& file,
                         const factor_graph::files::GraphFileError& error) {
  const std::string line = error.line > 0 ? fmt::format(", line {}", error.line) : "";
  throw std::runtime_error(fmt::format("{}{}: {}", file.string(), line, error.what));
}

factor_graph::files::GraphFile read(const std::filesystem::path& file) {
  const std::string text = io::read_whole_file(file);
  auto graph = read_graph(text, factor_graph::files::guess_format(text));
  if (const auto* error = std::get_if<factor_graph::files::GraphFileError>(&graph)) {
    refuse(file, *error);
  }
  auto& read = std::get<factor_graph::files::GraphFile>(graph);
  if (const auto untied = find_untied(read)) refuse(file, *untied);

  for (const auto& skipped : read.skipped) {
    fmt::print(stderr, "{}: {} lines \"{}\" passed over, the first is line {}\n", file.string(),
               skipped.lines, terminal::printable(skipped.tag), skipped.first_line);
  }
  if (!read.self_edges.empty()) {
    fmt::print(stderr, "{}: {} edges from a vertex to itself left out, the first in line {}\n",
               file.string(), read.self_edges.size(), read.self_edges.front());
  }
  return std::move(read);
}

bool is_pose(factor_graph::graph::VariableType type) {
  return type == factor_graph::graph::VariableType::kPose2 ||
         type == factor_graph::graph::VariableType::kPose3;
}

/// Hands out a file's factors pose by pose.
class Feeder {
 public:
  explicit Feeder(const factor_graph::files::GraphFile& file)
      : file_(file), times_(file.vertices.size(), -1), names_(file.vertices.size()) {
    int poses = 0;
    for (std::size_t v = 0; v < file.vertices.size(); ++v) {
      if (is_pose(file.vertices[v].type)) times_[v] = poses++;
    }
    factors_at_.resize(static_cast<std::size_t>(poses));
    for (std::size_t f = 0; f < file.factors.size(); ++f) {
      factors_at_[static_cast<std::size_t>(last_time(file.factors[f]))].push_back(f);
    }
    for (int k = 0; k < poses; ++k) sort_by_age(k);
  }

  std::size_t poses() const { return factors_at_.size(); }

  /// Adds pose k: placed by the motion from the pose before it, where there is one. Edges that are
  /// attached to what is placed come first; those that are not yet wait, for the next poses where
  /// need be: only one pose is held fast.
  void feed(std::size_t k, factor_graph::bayes_tree::IncrementalSmoother& smoother) {
    waiting_.insert(waiting_.end(), factors_at_[k].begin(), factors_at_[k].end());
    if (waiting_.empty()) return;
    if (!has_started_) start(vertex(file_.factors[waiting_.front()], 0), smoother);
    has_started_ = true;

    for (bool has_grown = true; has_grown;) {
      std::vector<std::size_t> left;
      for (const std::size_t f : waiting_) {
        if (is_attached(file_.factors[f])) {
          add(f, smoother);
        } else {
          left.push_back(f);
        }
      }
      has_grown = left.size() < waiting_.size();
      waiting_ = std::move(left);
    }
  }

 private:
  static std::size_t vertex(const factor_graph::graph::Factor& factor, std::size_t i) {
    return static_cast<std::size_t>(index(factor.variables[i]));
  }
  int last_time(const factor_graph::graph::Factor& factor) const {
    return std::max({times_[vertex(factor, 0)], times_[vertex(factor, 1)], 0});
  }
  /// Whether the edge's ends are placed, or the edge and one end give the other.
  bool is_attached(const factor_graph::graph::Factor& factor) const {
    if (names_[vertex(factor, 0)]) return true;
    return names_[vertex(factor, 1)] && is_pose(file_.vertices[vertex(factor, 1)].type);
  }
  void add(std::size_t f, factor_graph::bayes_tree::IncrementalSmoother& smoother) {
    factor_graph::graph::Factor factor = file_.factors[f];
    const auto a = vertex(factor, 0);
    const auto b = vertex(factor, 1);
    if (!names_[b]) names_[b] = placed(factor, *names_[a], smoother);
    if (!names_[a]) names_[a] = placed_backwards(factor, *names_[b], smoother);
    factor.variables = {*names_[a], *names_[b]};
    smoother.add(factor);
  }
  /// Motions from recent poses first.
  void sort_by_age(int k) {
    const auto age = [&](std::size_t f) {
      const int other =
          std::min(times_[vertex(file_.factors[f], 0)], times_[vertex(file_.factors[f], 1)]);
      return other < 0 ? 1 << 30 : k - other;
    };
    auto& factors = factors_at_[static_cast<std::size_t>(k)];
    std::stable_sort(factors.begin(), factors.end(),
                     [&](std::size_t x, std::size_t y) { return age(x) < age(y); });
  }

  void start(std::size_t v, factor_graph::bayes_tree::IncrementalSmoother& smoother) {
    if (file_.vertices[v].type == factor_graph::graph::VariableType::kPose2) {
      names_[v] = smoother.add_variable(geometry::SE2());
      smoother.add(prior(*names_[v], geometry::SE2(), kFixed * Eigen::Matrix3d::Identity()));
    } else {
      names_[v] = smoother.add_variable(factor_graph::graph::Pose3());
      const Eigen::Matrix<double, 6, 6> information =
          kFixed * Eigen::Matrix<double, 6, 6>::Identity();
      smoother.add(prior(*names_[v], factor_graph::graph::Pose3(), information));
    }
  }

  static factor_graph::graph::VariableId placed(
      const factor_graph::graph::Factor& factor, factor_graph::graph::VariableId a,
      factor_graph::bayes_tree::IncrementalSmoother& smoother) {
    const auto& z = factor.measurement;
    switch (factor.kind) {
      case factor_graph::graph::FactorKind::kRelativePose2:
        return smoother.add_variable(smoother.pose2(a) * geometry::SE2(z[0], z[1], z[2]));
      case factor_graph::graph::FactorKind::kRelativePose3:
        return smoother.add_variable(smoother.pose3(a) * factor_graph::graph::pose3_of(z));
      case factor_graph::graph::FactorKind::kPoint2:
        return smoother.add_variable(
            Eigen::Vector2d(smoother.pose2(a) * Eigen::Vector2d(z[0], z[1])));
      default:
        return smoother.add_variable(
            Eigen::Vector3d(smoother.pose3(a) * Eigen::Vector3d(z[0], z[1], z[2])));
    }
  }
  static factor_graph::graph::VariableId placed_backwards(
      const factor_graph::graph::Factor& factor, factor_graph::graph::VariableId b,
      factor_graph::bayes_tree::IncrementalSmoother& smoother) {
    const auto& z = factor.measurement;
    if (factor.kind == factor_graph::graph::FactorKind::kRelativePose2) {
      return smoother.add_variable(smoother.pose2(b) * geometry::SE2(z[0], z[1], z[2]).inverse());
    }
    if (factor.kind == factor_graph::graph::FactorKind::kRelativePose3) {
      return smoother.add_variable(smoother.pose3(b) * factor_graph::graph::pose3_of(z).inverse());
    }
    throw std::runtime_error("a pose that only landmarks tie to the others");
  }

  const factor_graph::files::GraphFile& file_;
  std::vector<int> times_;  ///< Of each pose; -1 of points.
  std::vector<std::optional<factor_graph::graph::VariableId>> names_;
  std::vector<std::vector<std::size_t>> factors_at_;
  std::vector<std::size_t> waiting_;
  bool has_started_ = false;
};

/// The same graph at the same estimates, solved whole.
factor_graph::batch::BatchReport solve_whole(const factor_graph::graph::FactorGraph& from) {
  factor_graph::graph::FactorGraph graph;
  std::vector<factor_graph::graph::VariableId> names;
  names.reserve(static_cast<std::size_t>(from.variable_capacity()));
  for (int v = 0; v < from.variable_capacity(); ++v) {
    names.push_back(graph.add(from.type(factor_graph::graph::VariableId(v)),
                              from.value(factor_graph::graph::VariableId(v))));
  }

  for (int f = 0; f < from.factor_capacity(); ++f) {
    factor_graph::graph::Factor factor;
    factor.kind = from.kind(factor_graph::graph::FactorId(f));
    const auto variables = from.variables_of(f);
    factor.variable_count = static_cast<int>(variables.size());
    for (std::size_t i = 0; i < variables.size(); ++i) {
      factor.variables[i] = names[static_cast<std::size_t>(variables[i])];
    }
    const auto measurement = from.measurement(factor_graph::graph::FactorId(f));
    std::copy(measurement.begin(), measurement.end(), factor.measurement.begin());
    factor.information = from.information(factor_graph::graph::FactorId(f));
    graph.add(factor);
  }

  factor_graph::batch::BatchParameters parameters;
  parameters.relative_decrease = 1e-10;
  return optimise(graph, parameters);
}

/// What a batch solver makes of the same data without the estimates that grew with them.
double solve_from_dead_reckoning(const factor_graph::files::GraphFile& file) {
  factor_graph::bayes_tree::IncrementalSmoother never_updated;
  Feeder feeder(file);
  for (std::size_t k = 0; k < feeder.poses(); ++k) feeder.feed(k, never_updated);
  return solve_whole(never_updated.graph()).chi2;
}

}  // namespace

BackendRun run_backend(const std::filesystem::path& file) {
  return run_backend(read(file), file.stem().string());
}

BackendRun run_backend(const factor_graph::files::GraphFile& graph, const std::string& dataset) {
  BackendRun run;
  run.dataset = dataset;
  run.factors = graph.factors.size();
  Feeder feeder(graph);
  run.poses = feeder.poses();
  run.points = graph.vertices.size() - run.poses;

  if (const auto untied = find_untied(graph)) throw std::runtime_error(untied->what);

  // Pose by pose; then until all estimates are up to date.
  const auto smoother = std::make_unique<factor_graph::bayes_tree::IncrementalSmoother>();
  for (std::size_t k = 0; k < feeder.poses(); ++k) {
    const double begin = tools::thread_time_s();
    feeder.feed(k, *smoother);
    const factor_graph::bayes_tree::IncrementalUpdate update = smoother->update();
    run.update_ms.push_back(1e3 * (tools::thread_time_s() - begin));
    if (!update.ok && run.error.empty()) run.error = update.error;
  }

  const double begin = tools::thread_time_s();
  smoother->settle();
  run.settle_ms = 1e3 * (tools::thread_time_s() - begin);

  run.chi2_final = smoother->graph().chi2();
  run.rss_mb = tools::resident_mb();
  run.smoother_mb = static_cast<double>(smoother->bytes()) / 1048576.0;

  // References: one fresh factorisation, a batch solver from here and from dead reckoning.
  const double before = tools::thread_time_s();
  const int iterations = std::max(1, smoother->update_everything().iterations);
  run.whole_ms = 1e3 * (tools::thread_time_s() - before) / iterations;

  const double start = tools::thread_time_s();
  const factor_graph::batch::BatchReport report = solve_whole(smoother->graph());
  run.batch_s = tools::thread_time_s() - start;
  run.chi2_batch = report.chi2;
  if (!report.ok) run.error = "batch: " + report.error;

  run.chi2_dead_reckoning = solve_from_dead_reckoning(graph);
  return run;
}

}  // namespace understory::eval::experiments::backend
