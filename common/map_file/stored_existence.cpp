#include "common/map_file/stored_existence.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "common/map_file/map_file.hpp"

namespace understory::map_file {
namespace {

std::string fault_of_existence(const model::LandmarkExistence& one, model::LandmarkId last) {
  if (one.id <= last) return "ids do not ascend";
  if (!(one.probability >= 0.0 && one.probability <= 1.0)) return "its existence is no probability";
  return {};
}

std::string existence_fault(model::LandmarkId id, const std::string& fault) {
  return fault.empty() ? fault : fmt::format("existence of landmark {}: {}", id, fault);
}

/// Whether a message has room for one more state of this size.
bool takes_more(const model::ExistenceState& message, std::size_t bytes) {
  const std::size_t landmarks = message.landmarks.size();
  return landmarks < kStatesTogether && message.states.size() == landmarks * bytes;
}

}  // namespace

void NewestExistence::take(const model::ExistenceState& state) {
  if (!has_learned_ || state.utime >= utime_) {
    has_learned_ = true;
    utime_ = state.utime;
    learned_ = state.model;
  }
  for (std::size_t i = 0; i < state.landmarks.size(); ++i) {
    const auto found = rows_.find(state.landmarks[i].id);
    if (found != rows_.end() && found->second.utime > state.utime) continue;
    rows_[state.landmarks[i].id] = {state.landmarks[i], state.utime, state.state_of(i)};
  }
}

void NewestExistence::drop_given_by(std::uint32_t map_id) {
  rows_.erase(rows_.lower_bound(landmark_id(map_id, 0)),
              rows_.lower_bound(landmark_id(map_id + 1, 0)));
}

StoredExistence NewestExistence::stored() const {
  StoredExistence result{utime_, learned_, {}};
  result.landmarks.reserve(rows_.size());
  for (const auto& [id, row] : rows_) result.landmarks.push_back(row);
  return result;
}

std::string fault_of(const model::ExistenceState& state) {
  const std::size_t landmarks = state.landmarks.size();
  const bool has_states = landmarks == 0
                              ? state.states.empty()
                              : !state.states.empty() && state.states.size() % landmarks == 0;
  if (!has_states) return "existence: not each landmark has a state of the same size";

  model::LandmarkId last = 0;
  for (const model::LandmarkExistence& one : state.landmarks) {
    std::string fault = fault_of_existence(one, last);
    if (!is_id_of(one.id, state.map_id))
      fault = fmt::format("its id is none of map {}", state.map_id);
    if (!fault.empty()) return existence_fault(one.id, fault);
    last = one.id;
  }
  return {};
}

std::string fault_of(const StoredExistence& existence, std::span<const model::LandmarkId> ids) {
  model::LandmarkId last = 0;
  for (const ExistenceRow& row : existence.landmarks) {
    const model::LandmarkId id = row.existence.id;
    std::string fault = fault_of_existence(row.existence, last);
    if (fault.empty() && row.state.empty()) fault = "its state is empty";
    if (fault.empty() && !std::ranges::binary_search(ids, id)) fault = "it is not in the map";
    if (!fault.empty()) return existence_fault(id, fault);
    last = id;
  }
  return {};
}

std::vector<model::ExistenceState> messages_of(std::uint32_t map_id,
                                               const StoredExistence& existence) {
  const model::ExistenceState empty{existence.utime, 0, map_id, {}, existence.learned, {}};
  std::vector<model::ExistenceState> messages{empty};
  for (const ExistenceRow& row : existence.landmarks) {
    if (!takes_more(messages.back(), row.state.size())) {
      messages.push_back(empty);
      messages.back().sequence = messages.size() - 1;
    }

    model::ExistenceState& message = messages.back();
    const bool is_first = message.landmarks.empty();
    message.utime = is_first ? row.utime : std::max(message.utime, row.utime);
    message.landmarks.push_back(row.existence);
    message.states += row.state;
  }
  return messages;
}

std::vector<model::ExistenceState> existence_of(const MapFile& file, std::uint32_t map_id) {
  const StoredMap map = file.read(map_id);
  if (!map.existence) return {};
  return messages_of(map_id, *map.existence);
}

}  // namespace understory::map_file
