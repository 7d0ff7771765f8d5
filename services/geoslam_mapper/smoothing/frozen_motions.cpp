#include "services/geoslam_mapper/smoothing/frozen_motions.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Below this share of a diagonal element, the rest after elimination of earlier directions is
/// rounding.
constexpr double kNothingLeft = 1e-12;

/// Cholesky factor of a positive semidefinite matrix; a direction without information has a column
/// of zeros.
Eigen::Matrix3d root_of(const Eigen::Matrix3d& information) {
  Eigen::Matrix3d root = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const double left = information(k, k) - root.row(k).head(k).squaredNorm();
    if (left <= kNothingLeft * information(k, k)) continue;
    root(k, k) = std::sqrt(left);
    for (int i = k + 1; i < 3; ++i)
      root(i, k) = (information(i, k) - root.row(i).head(k).dot(root.row(k).head(k))) / root(k, k);
  }
  return root;
}

}  // namespace

bool FrozenMotions::can_pack(const FrozenMotion& motion) {
  const std::int64_t a_to_b = std::int64_t{motion.b} - std::int64_t{motion.a};
  return motion.closure == 0 && std::in_range<std::int16_t>(a_to_b) &&
         std::in_range<std::uint16_t>(motion.away);
}

FrozenMotions::Packed FrozenMotions::packed(const FrozenMotion& motion) {
  Packed result;
  result.a = motion.a;
  result.a_to_b = static_cast<std::int16_t>(std::int64_t{motion.b} - std::int64_t{motion.a});
  result.away = static_cast<std::uint16_t>(motion.away);
  const Eigen::Vector3f coordinates = motion.a_T_b.coordinates().cast<float>();
  std::copy_n(coordinates.data(), 3, result.a_T_b.begin());
  const Eigen::Matrix3d root = root_of(motion.information);
  std::size_t at = 0;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k <= i; ++k) result.root[at++] = static_cast<float>(root(i, k));
  return result;
}

FrozenMotion FrozenMotions::unpacked(const Packed& packed) {
  Eigen::Matrix3d root = Eigen::Matrix3d::Zero();
  std::size_t at = 0;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k <= i; ++k) root(i, k) = packed.root[at++];
  const auto& [x_m, y_m, theta_rad] = packed.a_T_b;
  return {packed.a,    packed.b(), geometry::SE2(x_m, y_m, theta_rad), root * root.transpose(),
          packed.away, 0};
}

void FrozenMotions::add(const FrozenMotion& motion) {
  if (can_pack(motion)) {
    packed_.push_back(packed(motion));
  } else {
    whole_.push_back(motion);
  }
}

std::vector<FrozenMotion> FrozenMotions::take_beyond(const NodeSet& frozen) {
  std::vector<FrozenMotion> taken;
  const auto is_beyond = [&](NodeIndex a, NodeIndex b) {
    return !frozen.contains(a) && !frozen.contains(b);
  };
  std::erase_if(packed_, [&](const Packed& one) {
    if (!is_beyond(one.a, one.b())) return false;
    taken.push_back(unpacked(one));
    return true;
  });
  std::erase_if(whole_, [&](const FrozenMotion& one) {
    if (!is_beyond(one.a, one.b)) return false;
    taken.push_back(one);
    return true;
  });
  return taken;
}

std::vector<FrozenMotion> FrozenMotions::all() const {
  std::vector<FrozenMotion> result;
  result.reserve(size());
  for (const Packed& one : packed_) result.push_back(unpacked(one));
  result.insert(result.end(), whole_.begin(), whole_.end());
  return result;
}

bool FrozenMotions::has_closure(std::uint64_t id) const {
  return std::ranges::find(whole_, id, &FrozenMotion::closure) != whole_.end();
}

}  // namespace understory::geoslam_mapper::smoothing
