// Submaps of a mapper on the disk, for experiments without the store's process.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "common/model/map.hpp"
#include "common/model/submap.hpp"

namespace understory::geoslam_mapper::smoothing {
class SmoothingMapper;
}

namespace understory::eval::harness {

/// A temporary file of submaps as they go over the bus.
class SubmapShelf {
 public:
  /// Throws std::runtime_error where no temporary file can be made.
  SubmapShelf();

  /// Takes what the mapper gave away and brings back what it wants; to be called after each
  /// keyframe. Throws std::runtime_error where the mapper refuses its own, or the disk is full.
  void serve(geoslam_mapper::smoothing::SmoothingMapper& mapper);
  /// The pose of every keyframe that is here, frame `map`.
  std::vector<model::KeyframePose> keyframes(
      const geoslam_mapper::smoothing::SmoothingMapper& mapper) const;
  /// Number of landmarks that are here.
  std::size_t landmarks() const;
  /// Bytes of the submaps that are here.
  std::size_t bytes() const;
  /// Number of submaps that were brought back so far.
  std::size_t brought_back() const { return brought_back_; }

 private:
  struct Place {
    long offset = 0;
    std::uint32_t bytes = 0;  ///< 0: the submap is not here.
    std::uint32_t landmarks = 0;
  };
  model::Submap read(const Place& place) const;

  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::vector<Place> places_;  ///< By id.
  std::size_t brought_back_ = 0;
};

}  // namespace understory::eval::harness
