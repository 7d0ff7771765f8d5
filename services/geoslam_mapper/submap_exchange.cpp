#include "services/geoslam_mapper/submap_exchange.hpp"

#include <algorithm>
#include <utility>

namespace understory::geoslam_mapper {

SubmapExchange::Messages SubmapExchange::on_keyframe(model::Utime utime, MapperMethod& mapper,
                                                     PublishedMap& map) {
  for (model::Submap& submap : mapper.take_given_away()) {
    map.give_away(submap);
    hand_over_.add(std::move(submap));
  }
  Messages messages;
  messages.submaps = hand_over_.due(utime);

  std::vector<model::SubmapId> away;
  for (const model::SubmapId id : mapper.wanted()) {
    const auto submap = hand_over_.take(map.map_id(), id);
    if (!submap) {
      away.push_back(id);
      continue;
    }
    std::string refused = on_reply(*submap, mapper, map);
    if (!refused.empty()) messages.refused.push_back(std::move(refused));
  }
  messages.query = {utime, 0, map.map_id(), hand_over_.to_ask(away, utime)};
  mapper.may_hand_over(keeps_up());
  return messages;
}

void SubmapExchange::on_stored(const model::SubmapStored& stored, MapperMethod& mapper) {
  hand_over_.confirm(stored);
  mapper.may_hand_over(keeps_up());
}

std::string SubmapExchange::on_reply(const model::Submap& submap, MapperMethod& mapper,
                                     PublishedMap& map) const {
  const std::vector<model::SubmapId> wanted = mapper.wanted();
  if (std::ranges::find(wanted, submap.id) == wanted.end()) return {};
  std::string refused = mapper.bring_back(submap);
  if (refused.empty()) map.take_back(submap);
  return refused;
}

std::optional<model::MapCorrection> SubmapExchange::correction(const MapperMethod& mapper,
                                                               const PublishedMap& map,
                                                               model::Utime now, bool is_last) {
  if (!is_last && !corrections_.is_due(now)) return std::nullopt;
  return corrections_.next(map.utime(), map.map_id(), mapper.submap_poses(), is_last);
}

}  // namespace understory::geoslam_mapper
