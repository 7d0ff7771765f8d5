#include "common/hierarchy/descriptor_index.hpp"

#include <algorithm>
#include <cmath>

namespace understory::hierarchy {
namespace {

/// Bits per coordinate of a cell in its key; values beyond are clamped into the last cell, which
/// keeps the order of cells, so every query stays exact.
constexpr std::int32_t kMaxCell = (1 << 21) - 1;

}  // namespace

std::int32_t DescriptorIndex::cell_of(float value) const {
  const float cell = std::floor(value / cell_size_);
  return static_cast<std::int32_t>(std::clamp(cell, 0.0F, static_cast<float>(kMaxCell)));
}

std::uint64_t DescriptorIndex::key_of(const Cell& cell) {
  std::uint64_t key = 0;
  for (const std::int32_t coordinate : cell) {
    key = (key << 21U) | static_cast<std::uint64_t>(coordinate);
  }
  return key;
}

void DescriptorIndex::insert(std::uint32_t key, const Descriptor& descriptor) {
  Cell cell{};
  for (std::size_t i = 0; i < kBins.size(); ++i) {
    cell[i] = cell_of(descriptor[kBins[i]]);
  }
  cells_[key_of(cell)].push_back({key, descriptor});
  ++size_;
}

bool DescriptorIndex::erase(std::uint32_t key, const Descriptor& descriptor) {
  Cell cell{};
  for (std::size_t i = 0; i < kBins.size(); ++i) {
    cell[i] = cell_of(descriptor[kBins[i]]);
  }

  const auto found = cells_.find(key_of(cell));
  if (found == cells_.end()) {
    return false;
  }

  auto& entries = found->second;
  const auto entry = std::find_if(entries.begin(), entries.end(),
                                  [key](const Entry& candidate) { return candidate.key == key; });
  if (entry == entries.end()) {
    return false;
  }

  *entry = entries.back();
  entries.pop_back();
  if (entries.empty()) {
    cells_.erase(found);
  }

  --size_;
  return true;
}

void DescriptorIndex::scan(const std::vector<Entry>& entries, const Descriptor& descriptor,
                           float radius, std::vector<Hit>& hits) const {
  for (const Entry& entry : entries) {
    const float d = distance(entry.descriptor, descriptor);
    if (d <= radius) {
      hits.push_back({entry.key, d});
    }
  }
}

void DescriptorIndex::within(const Descriptor& descriptor, float radius,
                             std::vector<Hit>& hits) const {
  hits.clear();
  Cell low{};
  Cell high{};
  double cells = 1.0;

  for (std::size_t i = 0; i < kBins.size(); ++i) {
    // Slightly wider than the radius, because the subtraction rounds; the exact distance decides.
    const float reach = radius + 1e-4F * (1.0F + descriptor[kBins[i]]);
    low[i] = cell_of(descriptor[kBins[i]] - reach);
    high[i] = cell_of(descriptor[kBins[i]] + reach);
    cells *= high[i] - low[i] + 1.0;
  }

  if (cells > static_cast<double>(cells_.size())) {
    for (const auto& cell : cells_) {
      scan(cell.second, descriptor, radius, hits);
    }
  } else {
    Cell cell{};
    for (cell[0] = low[0]; cell[0] <= high[0]; ++cell[0]) {
      for (cell[1] = low[1]; cell[1] <= high[1]; ++cell[1]) {
        for (cell[2] = low[2]; cell[2] <= high[2]; ++cell[2]) {
          if (const auto found = cells_.find(key_of(cell)); found != cells_.end()) {
            scan(found->second, descriptor, radius, hits);
          }
        }
      }
    }
  }

  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.key < b.key;
  });
}

}  // namespace understory::hierarchy
