#include "eval/harness/submap_shelf.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::eval::harness {
namespace {

/// Submaps that the list of places has room for from the start: who measures the mapper's heap
/// across serve() does not measure the list.
constexpr std::size_t kRoom = std::size_t{1} << 16U;

}  // namespace

SubmapShelf::SubmapShelf() : file_(std::tmpfile(), &std::fclose) {
  places_.reserve(kRoom);
  if (!file_) throw std::runtime_error("no temporary file for submaps");
}

void SubmapShelf::serve(geoslam_mapper::smoothing::SmoothingMapper& mapper) {
  for (const model::Submap& submap : mapper.take_given_away()) {
    for (const model::SubmapId id : submap.replaced) places_.at(id) = {};
    const auto bytes = wire::encode_message(submap);
    std::fseek(file_.get(), 0, SEEK_END);
    const Place place{std::ftell(file_.get()), static_cast<std::uint32_t>(bytes.size()),
                      static_cast<std::uint32_t>(submap.landmarks.size())};
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
      throw std::runtime_error("submaps: no room on the disk");
    if (places_.size() <= submap.id) places_.resize(submap.id + 1);
    places_[submap.id] = place;
  }

  for (const model::SubmapId id : mapper.wanted()) {
    const std::string refused = mapper.bring_back(read(places_.at(id)));
    if (!refused.empty()) throw std::runtime_error(refused);
    places_.at(id) = {};
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
    const geoslam_mapper::smoothing::SmoothingMapper& mapper) const {
  std::vector<model::KeyframePose> result;
  for (const model::SubmapPose& pose : mapper.submap_poses()) {
    if (pose.id >= places_.size() || places_[pose.id].bytes == 0) continue;
    for (model::KeyframePose keyframe : read(places_[pose.id]).keyframes) {
      keyframe.map_T_vehicle = pose.map_T_submap * keyframe.map_T_vehicle;
      result.push_back(keyframe);
    }
  }
  return result;
}

std::size_t SubmapShelf::landmarks() const {
  return std::accumulate(places_.begin(), places_.end(), std::size_t{0},
                         [](std::size_t sum, const auto& one) { return sum + one.landmarks; });
}

std::size_t SubmapShelf::bytes() const {
  return std::accumulate(places_.begin(), places_.end(), std::size_t{0},
                         [](std::size_t sum, const auto& one) { return sum + one.bytes; });
}

}  // namespace understory::eval::harness
