// A shell of 20 face visibilities and 12 vertex reaches (thesis 003, Implementation).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "common/existence/icosahedron.hpp"
#include "common/existence/odds.hpp"
#include "common/existence/shell.hpp"

namespace understory::existence {

/// 20 odds, their 20 values at the begin of the pass, 12 distances: 208 bytes.
class IcosahedralShell {
 public:
  using Place = FacePoint;
  static constexpr std::size_t kNumbers = 2 * kFaces + kVertices;
  static constexpr std::uint32_t kKind = 1;

  IcosahedralShell(float visibility_odds, float reach_m) {
    odds_.fill(visibility_odds);
    before_.fill(visibility_odds);
    reach_m_.fill(reach_m);
  }

  Place locate(const Eigen::Vector3f& direction) const { return locate_on_icosahedron(direction); }
  float visibility_odds(const Place& place) const { return odds_[index_of(place)]; }
  int sector(const Place& place) const { return place.face; }

  /// Reach at a place [m], barycentric within the face.
  float reach_m(const Place& place) const {
    float reach = 0.0F;
    for (std::size_t i = 0; i < 3; ++i) reach += place.weights[i] * reach_m_[place.vertices[i]];
    return reach;
  }

  void multiply(const Place& place, float ratio, float most_odds) {
    float& odds = odds_[index_of(place)];
    odds = std::clamp(odds * ratio, kLeastVisibilityOdds, most_odds);
  }

  /// Raises the three vertices by least squares, so that the place gets the distance.
  void extend(const Place& place, float distance_m) {
    const float missing_m = distance_m - reach_m(place);
    if (!(missing_m > 0.0F)) return;
    float squares = 0.0F;
    for (const float weight : place.weights) squares += weight * weight;
    for (std::size_t i = 0; i < 3; ++i)
      reach_m_[place.vertices[i]] += missing_m * place.weights[i] / squares;
  }

  void relax(float rest, float share) {
    const auto moved = [&](float& odds) { odds = static_cast<float>(relaxed(odds, rest, share)); };
    std::for_each(odds_.begin(), odds_.end(), moved);
    std::for_each(before_.begin(), before_.end(), moved);
  }

  void begin_pass() { before_ = odds_; }
  void end_pass(float share) {
    for (std::size_t face = 0; face < odds_.size(); ++face) {
      if (odds_[face] == before_[face]) continue;
      const double now = probability_of(odds_[face]);
      const double then = probability_of(before_[face]);
      odds_[face] = static_cast<float>(odds_of(then + (now - then) * share));
    }
  }

  void store(std::span<float> numbers) const {
    auto out = std::copy(odds_.begin(), odds_.end(), numbers.begin());
    out = std::copy(before_.begin(), before_.end(), out);
    std::copy(reach_m_.begin(), reach_m_.end(), out);
  }
  /// False where a number is impossible: not finite, or odds or reach not above 0.
  bool restore(std::span<const float> numbers) {
    const auto can_be = [](float number) { return std::isfinite(number) && number > 0.0F; };
    if (numbers.size() != kNumbers || !std::all_of(numbers.begin(), numbers.end(), can_be))
      return false;
    std::copy_n(numbers.begin(), kFaces, odds_.begin());
    std::copy_n(numbers.begin() + kFaces, kFaces, before_.begin());
    std::copy_n(numbers.begin() + 2 * kFaces, kVertices, reach_m_.begin());
    return true;
  }

  /// Visibility of a face, for drawings.
  double face_visibility(int face) const {
    return probability_of(odds_[static_cast<std::size_t>(face)]);
  }
  /// Reach at a vertex [m], for drawings.
  float vertex_reach_m(int vertex) const { return reach_m_[static_cast<std::size_t>(vertex)]; }

 private:
  static std::size_t index_of(const Place& place) { return static_cast<std::size_t>(place.face); }

  std::array<float, kFaces> odds_{};    ///< w_f / (1 - w_f), given that the pass can see the point.
  std::array<float, kFaces> before_{};  ///< Odds at the begin of the pass.
  std::array<float, kVertices> reach_m_{};  ///< d_v.
};
static_assert(Shell<IcosahedralShell>);
static_assert(sizeof(IcosahedralShell) == 208);

}  // namespace understory::existence
