#include "deploy/cli/frame_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/map_merge/fusion.hpp"
#include "common/map_merge/pairing.hpp"
#include "deploy/cli/failure.hpp"

namespace understory::cli {
namespace {

using map_merge::AlignmentParameters;
using map_merge::Pairing;

bool shows_one_frame(const Pairing& pairing, const AlignmentParameters& wanted) {
  return pairing.pairs.size() >= wanted.min_pairs && pairing.share() >= wanted.min_share &&
         pairing.log10_tail <= wanted.max_log10_false_alarm;
}

/// The pairing of the two maps with the most common landmarks in their present frames; none without
/// maps.
std::optional<Pairing> best_pairing(const MapsInFrame& first, const MapsInFrame& second,
                                    const AlignmentParameters& wanted) {
  std::optional<Pairing> best;
  for (const auto& one : first.maps) {
    const map_merge::LandmarkSet here(one, wanted.unknown_sigma_m);
    for (const auto& other : second.maps) {
      const map_merge::LandmarkSet there(other, wanted.unknown_sigma_m);
      Pairing pairing = map_merge::pair_up(here, there, map_merge::DifferenceModel{}, wanted);
      if (!best || pairing.log10_tail < best->log10_tail) best = std::move(pairing);
    }
  }
  return best;
}

}  // namespace

MapsInFrame maps_in(const map_file::MapFile& file) {
  MapsInFrame found{file.file().string(), {}};
  for (const map_file::MapSummary& one : file.maps())
    found.maps.push_back(map_merge::landmarks_of(file.read(one.map_id)));
  return found;
}

void require_one_frame(const MapsInFrame& first, const MapsInFrame& second) {
  const AlignmentParameters wanted = map_merge::with_guess({});
  const Pairing found = best_pairing(first, second, wanted).value_or(Pairing{});
  if (shows_one_frame(found, wanted)) return;
  fail(fmt::format(
      "{}: its landmarks do not show the frame of {}: {} are at the same places (at least {}), "
      "{:.0f} "
      "% of the {} that lie where both have some (at least {:.0f} %), by chance 10^{:.0f} (at most "
      "10^{:.0f}); did the drive begin with that map? --force takes it all the same",
      first.source, second.source, found.pairs.size(), wanted.min_pairs, 100.0 * found.share(),
      std::min(found.first_in_overlap, found.second_in_overlap), 100.0 * wanted.min_share,
      found.log10_tail, wanted.max_log10_false_alarm));
}

}  // namespace understory::cli
