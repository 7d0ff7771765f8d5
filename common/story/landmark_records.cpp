#include "common/story/landmark_records.hpp"

namespace understory::story {

LandmarkRecords::LandmarkRecords(std::size_t limit, std::size_t bytes)
    : limit_(std::max<std::size_t>(2, std::min(limit, bytes / landmark_bytes()))), budget_(bytes) {}

LandmarkRecord& LandmarkRecords::touch(model::LandmarkId id) {
  const auto found = place_of_.find(id);
  const bool is_known = found != place_of_.end();
  const std::uint32_t place = is_known ? found->second : place_for(id);
  if (is_known && place != newest_) unlink(place);
  if (place != newest_) make_newest(place);
  make_room();
  return records_[place];
}

/// Frees memory so that the newest record can grow.
void LandmarkRecords::make_room() {
  constexpr std::size_t kRoomBytes = 65'536;
  while (budget_.left() < kRoomBytes) {
    const std::uint32_t next = trimmed_ == kNone ? oldest_ : records_[trimmed_].newer;
    if (next == kNone || next == newest_) return;
    LandmarkRecord& record = records_[next];
    record.looks.trim(budget_);
    record.probabilities.trim(budget_);
    record.events.trim(budget_);
    trimmed_ = next;
  }
}

const LandmarkRecord* LandmarkRecords::find(model::LandmarkId id) const {
  const auto found = place_of_.find(id);
  return found == place_of_.end() ? nullptr : &records_[found->second];
}

void LandmarkRecords::begin_again(LandmarkRecord& record) {
  record.looks.clear(budget_);
  record.probabilities.clear(budget_);
  record.events.clear(budget_);
  LandmarkRecord fresh;
  fresh.id = record.id;
  fresh.newer = record.newer;
  fresh.older = record.older;
  record = std::move(fresh);
}

/// A free index that is not in the order yet.
std::uint32_t LandmarkRecords::place_for(model::LandmarkId id) {
  std::uint32_t place = 0;
  if (records_.size() < limit_) {
    place = static_cast<std::uint32_t>(records_.size());
    records_.emplace_back();
    budget_.take(kRecordBytes);
  } else {
    place = oldest_;
    unlink(place);
    place_of_.erase(records_[place].id);
    begin_again(records_[place]);
    ++forgotten_;
  }
  records_[place].id = id;
  place_of_[id] = place;
  return place;
}

void LandmarkRecords::make_newest(std::uint32_t place) {
  LandmarkRecord& record = records_[place];
  record.newer = kNone;
  record.older = newest_;
  if (newest_ != kNone) records_[newest_].newer = place;
  newest_ = place;
  if (oldest_ == kNone) oldest_ = place;
}

void LandmarkRecords::unlink(std::uint32_t place) {
  const LandmarkRecord& record = records_[place];
  if (record.newer != kNone) records_[record.newer].older = record.older;
  if (record.older != kNone) records_[record.older].newer = record.newer;
  if (newest_ == place) newest_ = record.older;
  if (oldest_ == place) oldest_ = record.newer;
  if (trimmed_ == place) trimmed_ = record.older;
}

}  // namespace understory::story
