#include "deploy/cli/truth_track.hpp"

#include <iterator>

namespace understory::cli {
namespace {

/// Largest interval between two true poses for interpolation [us].
constexpr model::Utime kLongestGap = 200'000;

}  // namespace

std::optional<geometry::SE2> TruthTrack::at(model::Utime utime) const {
  const auto after = poses_.lower_bound(utime);
  if (after == poses_.end()) return std::nullopt;
  if (after->first == utime) return after->second;
  if (after == poses_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (after->first - before->first > kLongestGap) return std::nullopt;

  const double share = static_cast<double>(utime - before->first) /
                       static_cast<double>(after->first - before->first);
  return before->second *
         geometry::SE2::Exp(share * (before->second.inverse() * after->second).Log());
}

}  // namespace understory::cli
