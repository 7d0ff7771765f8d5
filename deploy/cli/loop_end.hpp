// The ends of a loop closure on the command line.
#pragma once

#include <string>

#include "common/model/submap.hpp"

namespace understory::cli {

/// `keyframe:N` or `submap:N` (from 1). Ends the command with a usage error where `text` is
/// neither; `option`: name of the option.
model::LoopEnd loop_end_of(const std::string& option, const std::string& text);

/// Numbers of manual closures are below this; those of loop_closer start here.
inline constexpr std::uint64_t kManualClosures = std::uint64_t{1} << 40;
/// The number of a closure from these texts: the same closure has the same number.
std::uint64_t manual_closure_id(const std::string& said);

}  // namespace understory::cli
