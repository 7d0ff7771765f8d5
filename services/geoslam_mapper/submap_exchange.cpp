#include "services/geoslam_mapper/submap_exchange.hpp"

#include <utility>

namespace understory::geoslam_mapper {

SubmapExchange::Messages SubmapExchange::on_keyframe(model::Utime utime,
                                                     std::vector<model::Submap> given_away,
                                                     const std::vector<model::SubmapId>& wanted,
                                                     std::uint32_t map_id) {
  for (model::Submap& submap : given_away) hand_over_.add(std::move(submap));
  Messages messages;
  messages.submaps = hand_over_.due(utime);

  std::vector<model::SubmapId> away;
  for (const model::SubmapId id : wanted) {
    if (auto submap = hand_over_.take(map_id, id)) {
      messages.waited.push_back(std::move(*submap));
    } else {
      away.push_back(id);
    }
  }
  messages.query = {utime, 0, map_id, hand_over_.to_ask(away, utime)};
  return messages;
}

}  // namespace understory::geoslam_mapper
