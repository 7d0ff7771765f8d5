#include "tests/factor_graph/normal_equations.hpp"

#include <algorithm>
#include <stdexcept>

namespace understory::test {
namespace {

struct BlockEntry {
  int column;         ///< First column of the block.
  int row;            ///< First row of the block; row < column.
  std::uint8_t rows;  ///< Height of the block.
};

}  // namespace

NormalEquations::NormalEquations(const factor_graph::plane::Graph& graph) {
  if (!graph.scalars.empty())
    throw std::invalid_argument("normal equations: of poses and points alone");
  number_variables(graph);
  build_pattern(graph);
}

void NormalEquations::number_variables(const factor_graph::plane::Graph& graph) {
  pose_columns_.assign(graph.poses.size(), -1);
  point_columns_.assign(graph.points.size(), -1);
  const auto use_pose = [&](factor_graph::plane::PoseId id) { pose_columns_[index(id)] = 0; };
  const auto use_point = [&](factor_graph::plane::PointId id) { point_columns_[index(id)] = 0; };
  for (const factor_graph::plane::PosePrior& f : graph.pose_priors) use_pose(f.pose);
  for (const factor_graph::plane::PointPrior& f : graph.point_priors) use_point(f.point);
  for (const factor_graph::plane::RelativePose& f : graph.relative_poses) {
    use_pose(f.a);
    use_pose(f.b);
  }
  for (const factor_graph::plane::PointObservation& f : graph.observations) {
    use_pose(f.pose);
    use_point(f.point);
  }
  int next = 0;
  for (int& column : pose_columns_) {
    if (column == 0) column = next, next += 3;
  }
  for (int& column : point_columns_) {
    if (column == 0) column = next, next += 2;
  }
  hessian_.size = next;
}

void NormalEquations::build_pattern(const factor_graph::plane::Graph& graph) {
  // Off-diagonal blocks, each once, sorted by column and row.
  std::vector<BlockEntry> blocks;
  blocks.reserve(graph.relative_poses.size() + graph.observations.size());
  for (const factor_graph::plane::RelativePose& f : graph.relative_poses) {
    blocks.push_back({std::max(column(f.a), column(f.b)), std::min(column(f.a), column(f.b)), 3});
  }
  for (const factor_graph::plane::PointObservation& f : graph.observations) {
    blocks.push_back({column(f.point), column(f.pose), 3});
  }
  const auto less = [](const BlockEntry& a, const BlockEntry& b) {
    return a.column != b.column ? a.column < b.column : a.row < b.row;
  };
  std::sort(blocks.begin(), blocks.end(), less);
  blocks.erase(std::unique(blocks.begin(), blocks.end(),
                           [](const BlockEntry& a, const BlockEntry& b) {
                             return a.column == b.column && a.row == b.row;
                           }),
               blocks.end());

  // Height of each variable's columns above its diagonal block, and where each block starts in
  // them.
  std::vector<std::size_t> offsets(blocks.size());
  std::vector<int> height(static_cast<std::size_t>(hessian_.size) + 1, 0);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    offsets[i] = static_cast<std::size_t>(height[blocks[i].column]);
    height[blocks[i].column] += blocks[i].rows;
  }
  hessian_.column_starts.assign(1, 0);
  const auto add_columns = [&](int first, int width) {
    for (int k = 0; k < width; ++k) {
      hessian_.column_starts.push_back(hessian_.column_starts.back() + height[first] + k + 1);
    }
  };
  for (const int column : pose_columns_) {
    if (column >= 0) add_columns(column, 3);
  }
  for (const int column : point_columns_) {
    if (column >= 0) add_columns(column, 2);
  }
  hessian_.rows.resize(static_cast<std::size_t>(hessian_.column_starts.back()));
  hessian_.values.assign(hessian_.rows.size(), 0.0);
  const auto fill_diagonal = [&](int first, int width) {
    for (int k = 0; k < width; ++k) {
      const int start = hessian_.column_starts[first + k] + height[first];
      for (int r = 0; r <= k; ++r) hessian_.rows[start + r] = first + r;
    }
  };
  for (const int column : pose_columns_) {
    if (column >= 0) fill_diagonal(column, 3);
  }
  for (const int column : point_columns_) {
    if (column >= 0) fill_diagonal(column, 2);
  }
  const int first_point = hessian_.size - 2 * static_cast<int>(std::count_if(
                                                  point_columns_.begin(), point_columns_.end(),
                                                  [](int c) { return c >= 0; }));
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const int width = blocks[i].column >= first_point ? 2 : 3;
    for (int k = 0; k < width; ++k) {
      const std::size_t start = hessian_.column_starts[blocks[i].column + k] + offsets[i];
      for (int r = 0; r < blocks[i].rows; ++r) hessian_.rows[start + r] = blocks[i].row + r;
    }
  }
  const auto slot_of = [&](int a, int b) {
    const BlockEntry key{std::max(a, b), std::min(a, b), 3};
    const auto found = std::lower_bound(blocks.begin(), blocks.end(), key, less);
    return offsets[static_cast<std::size_t>(found - blocks.begin())];
  };
  for (const factor_graph::plane::RelativePose& f : graph.relative_poses) {
    relative_slots_.push_back(slot_of(column(f.a), column(f.b)));
  }
  for (const factor_graph::plane::PointObservation& f : graph.observations) {
    observation_slots_.push_back(slot_of(column(f.pose), column(f.point)));
  }
}

template <typename Block>
void NormalEquations::add_block(std::size_t slot, int first_column, const Block& block) {
  for (int k = 0; k < block.cols(); ++k) {
    double* values = &hessian_.values[hessian_.column_starts[first_column + k] + slot];
    for (int r = 0; r < block.rows(); ++r) values[r] += block(r, k);
  }
}

void NormalEquations::add_diagonal(int column, const Eigen::Ref<const Eigen::MatrixXd>& block) {
  for (int k = 0; k < block.cols(); ++k) {
    double* values = &hessian_.values[hessian_.column_starts[column + k + 1] - (k + 1)];
    for (int r = 0; r <= k; ++r) values[r] += block(r, k);
  }
}

void NormalEquations::linearise(const factor_graph::plane::Graph& graph) {
  std::fill(hessian_.values.begin(), hessian_.values.end(), 0.0);
  gradient_ = Eigen::VectorXd::Zero(hessian_.size);
  chi2_ = 0.0;
  for (const factor_graph::plane::PosePrior& f : graph.pose_priors) {
    const geometry::SE2 error = f.mean.inverse() * graph[f.pose];
    const Eigen::Vector3d e = error.coordinates();
    Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();
    jacobian.topLeftCorner<2, 2>() = error.rotation();
    const Eigen::Matrix3d weighted = jacobian.transpose() * f.information;
    add_diagonal(column(f.pose), weighted * jacobian);
    gradient_.segment<3>(column(f.pose)) += weighted * e;
    chi2_ += e.dot(f.information * e);
  }
  for (const factor_graph::plane::PointPrior& f : graph.point_priors) {
    const Eigen::Vector2d e = graph[f.point] - f.mean;
    add_diagonal(column(f.point), f.information);
    gradient_.segment<2>(column(f.point)) += f.information * e;
    chi2_ += e.dot(f.information * e);
  }
  for (std::size_t i = 0; i < graph.relative_poses.size(); ++i) {
    const factor_graph::plane::RelativePose& f = graph.relative_poses[i];
    const factor_graph::plane::RelativePoseJacobian j = factor_graph::plane::linearise(graph, f);
    const Eigen::Matrix3d wa = j.a.transpose() * f.information;
    const Eigen::Matrix3d wb = j.b.transpose() * f.information;
    add_diagonal(column(f.a), wa * j.a);
    add_diagonal(column(f.b), wb * j.b);
    const bool a_first = column(f.a) < column(f.b);
    const Eigen::Matrix3d cross = a_first ? Eigen::Matrix3d(wa * j.b) : Eigen::Matrix3d(wb * j.a);
    add_block(relative_slots_[i], std::max(column(f.a), column(f.b)), cross);
    gradient_.segment<3>(column(f.a)) += wa * j.residual;
    gradient_.segment<3>(column(f.b)) += wb * j.residual;
    chi2_ += j.residual.dot(f.information * j.residual);
  }
  for (std::size_t i = 0; i < graph.observations.size(); ++i) {
    const factor_graph::plane::PointObservation& f = graph.observations[i];
    const factor_graph::plane::ObservationJacobian j = factor_graph::plane::linearise(graph, f);
    const Eigen::Matrix<double, 3, 2> wp = j.pose.transpose() * f.information;
    const Eigen::Matrix2d wl = j.point.transpose() * f.information;
    const Eigen::Matrix3d pose_block = wp * j.pose;
    const Eigen::Matrix2d point_block = wl * j.point;
    const Eigen::Matrix<double, 3, 2> cross = wp * j.point;
    add_diagonal(column(f.pose), pose_block);
    add_diagonal(column(f.point), point_block);
    add_block(observation_slots_[i], column(f.point), cross);
    gradient_.segment<3>(column(f.pose)) += wp * j.residual;
    gradient_.segment<2>(column(f.point)) += wl * j.residual;
    chi2_ += j.residual.dot(f.information * j.residual);
  }
}

factor_graph::batch::SymmetricSparse NormalEquations::damped(double lambda) const {
  factor_graph::batch::SymmetricSparse result = hessian_;
  for (int c = 0; c < result.size; ++c)
    result.values[result.column_starts[c + 1] - 1] *= 1.0 + lambda;
  return result;
}

}  // namespace understory::test
