// The saved state of a node.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/state/archive.hpp"

namespace understory::bus {

/// The node's own part of a service's state, and the stage's saved bytes. Counts for HEALTH are not
/// part of it: they belong to one process.
struct NodeState {
  /// Version of the list of members.
  static constexpr state::Format kFormat{"node", 3};

  std::int64_t now_us = -1;  ///< TimeGate::now().
  /// Newest sequence number and stamp [us] of each input, by channel.
  std::map<std::string, std::pair<std::int64_t, std::int64_t>> inputs;
  /// Newest believed stamp [us] of each input and the interval before it, by channel.
  std::map<std::string, std::pair<std::int64_t, std::int64_t>> paces;
  std::map<std::string, std::int64_t> outputs;  ///< Next sequence number, by channel.
  std::vector<std::int64_t> timers_due_us;      ///< MessageTimers::due_us().
  std::string stage;                            ///< Adapter::save().

  /// Serialises the members, see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.now_us, self.inputs, self.paces, self.outputs, self.timers_due_us, self.stage);
  }
};

}  // namespace understory::bus
