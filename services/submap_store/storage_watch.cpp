#include "services/submap_store/storage_watch.hpp"

namespace understory::submap_store {
namespace {

/// Message time for which HEALTH shows a skipped file.
constexpr model::Utime kShown_us = 60'000'000;

bus::WatchedCondition watched(wire::Reason reason, std::string_view text) {
  return {reason, text, "SUBMAP", bus::Condition({1, 1})};
}

}  // namespace

wire::Reason reason_of(map_file::Fault fault) {
  using enum map_file::Fault;
  switch (fault) {
    case kFull:
      return wire::Reason::kDiskFull;
    case kReadOnly:
      return wire::Reason::kFileReadOnly;
    case kDamaged:
      return wire::Reason::kFileDamaged;
    case kForeign:
      return wire::Reason::kFileForeign;
    case kInUse:
      return wire::Reason::kFileInUse;
    case kRefused:
      return wire::Reason::kInputRefused;
    case kUnreadable:
    case kOtherVersion:
    case kUntrusted:
      break;
  }
  return wire::Reason::kFileUnusable;
}

StorageWatch::StorageWatch()
    : conditions_{
          watched(wire::Reason::kDiskFull, "no room for the map: nothing is stored"),
          watched(wire::Reason::kFileReadOnly,
                  "the map's file cannot be written: nothing is stored in it"),
          watched(wire::Reason::kFileDamaged,
                  "the map's file is damaged: nothing is stored in it any more"),
          watched(wire::Reason::kFileForeign,
                  "another program's file has the map's name: nothing is stored in it"),
          watched(wire::Reason::kFileInUse, "another process has the map open: nothing is stored"),
          watched(wire::Reason::kFileUnusable,
                  "the map's file cannot be used: nothing is stored in it")} {}

void StorageWatch::failed(map_file::Fault fault) {
  const wire::Reason reason = reason_of(fault);
  for (bus::WatchedCondition& one : conditions_) one.condition.add(one.reason == reason);
}

void StorageWatch::passed_over(map_file::Fault fault, model::Utime now) {
  passed_over_ = reason_of(fault);
  passed_over_at_ = now;
}

void StorageWatch::succeeded(model::Utime now) {
  if (passed_over_ && (now < passed_over_at_ || now - passed_over_at_ > kShown_us))
    passed_over_.reset();
  for (bus::WatchedCondition& one : conditions_) one.condition.add(passed_over_ == one.reason);
}

}  // namespace understory::submap_store
