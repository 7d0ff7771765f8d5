#include "eval/harness/submap_shelf.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/wire/convert.hpp"

namespace understory::eval::harness {

SubmapShelf::SubmapShelf() : file_(std::tmpfile(), &std::fclose) {
  if (!file_) throw std::runtime_error("no temporary file for submaps");
}

void SubmapShelf::serve(geoslam_mapper::MapperMethod& mapper) {
  for (const model::Submap& submap : mapper.take_given_away()) {
    for (const model::SubmapId id : submap.replaced) places_.erase(id);
    const auto bytes = wire::encode_message(submap);
    std::fseek(file_.get(), 0, SEEK_END);
    const Place place{std::ftell(file_.get()), bytes.size(), submap.landmarks.size()};
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
      throw std::runtime_error("submaps: no room on the disk");
    places_.emplace(submap.id, place);
  }

  for (const model::SubmapId id : mapper.wanted()) {
    const std::string refused = mapper.bring_back(read(places_.at(id)));
    if (!refused.empty()) throw std::runtime_error(refused);
    places_.erase(id);
    ++brought_back_;
  }
}

model::Submap SubmapShelf::read(const Place& place) const {
  std::vector<std::uint8_t> bytes(place.bytes);
  std::fseek(file_.get(), place.offset, SEEK_SET);
  if (std::fread(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    throw std::runtime_error("submaps: the temporary file ends early");
  return wire::decode_message<model::Submap>(bytes).value();
}

std::vector<model::KeyframePose> SubmapShelf::keyframes(
    const geoslam_mapper::MapperMethod& mapper) const {
  std::vector<model::KeyframePose> result;
  for (const model::SubmapPose& pose : mapper.submap_poses()) {
    const auto place = places_.find(pose.id);
    if (place == places_.end()) continue;
    for (model::KeyframePose keyframe : read(place->second).keyframes) {
      keyframe.map_T_vehicle = pose.map_T_submap * keyframe.map_T_vehicle;
      result.push_back(keyframe);
    }
  }
  return result;
}

std::size_t SubmapShelf::landmarks() const {
  return std::accumulate(
      places_.begin(), places_.end(), std::size_t{0},
      [](std::size_t sum, const auto& one) { return sum + one.second.landmarks; });
}

std::size_t SubmapShelf::bytes() const {
  return std::accumulate(places_.begin(), places_.end(), std::size_t{0},
                         [](std::size_t sum, const auto& one) { return sum + one.second.bytes; });
}

}  // namespace understory::eval::harness
