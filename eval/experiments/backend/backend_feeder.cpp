#include "eval/experiments/backend/backend_feeder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <variant>

#include "common/io/text_file.hpp"
#include "common/terminal/printable.hpp"

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

bool is_pose(factor_graph::graph::VariableType type) {
  return type == factor_graph::graph::VariableType::kPose2 ||
         type == factor_graph::graph::VariableType::kPose3;
}

std::size_t vertex(const factor_graph::graph::Factor& factor, std::size_t i) {
  return static_cast<std::size_t>(index(factor.variables[i]));
}

factor_graph::graph::VariableId placed(const factor_graph::graph::Factor& factor,
                                       factor_graph::graph::VariableId a,
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
factor_graph::graph::VariableId placed_backwards(
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

}  // namespace

factor_graph::files::GraphFile read_graph_file(const std::filesystem::path& file) {
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

Feeder::Feeder(const factor_graph::files::GraphFile& file)
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

void Feeder::feed(std::size_t k, factor_graph::bayes_tree::IncrementalSmoother& smoother) {
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

int Feeder::last_time(const factor_graph::graph::Factor& factor) const {
  return std::max({times_[vertex(factor, 0)], times_[vertex(factor, 1)], 0});
}

/// Whether the edge's ends are placed, or the edge and one end give the other.
bool Feeder::is_attached(const factor_graph::graph::Factor& factor) const {
  if (names_[vertex(factor, 0)]) return true;
  return names_[vertex(factor, 1)] && is_pose(file_.vertices[vertex(factor, 1)].type);
}

void Feeder::add(std::size_t f, factor_graph::bayes_tree::IncrementalSmoother& smoother) {
  factor_graph::graph::Factor factor = file_.factors[f];
  const auto a = vertex(factor, 0);
  const auto b = vertex(factor, 1);
  if (!names_[b]) names_[b] = placed(factor, *names_[a], smoother);
  if (!names_[a]) names_[a] = placed_backwards(factor, *names_[b], smoother);
  factor.variables = {*names_[a], *names_[b]};
  smoother.add(factor);
}

/// Motions from recent poses first.
void Feeder::sort_by_age(int k) {
  const auto age = [&](std::size_t f) {
    const int other =
        std::min(times_[vertex(file_.factors[f], 0)], times_[vertex(file_.factors[f], 1)]);
    return other < 0 ? 1 << 30 : k - other;
  };
  auto& factors = factors_at_[static_cast<std::size_t>(k)];
  std::stable_sort(factors.begin(), factors.end(),
                   [&](std::size_t x, std::size_t y) { return age(x) < age(y); });
}

void Feeder::start(std::size_t v, factor_graph::bayes_tree::IncrementalSmoother& smoother) {
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

}  // namespace understory::eval::experiments::backend
