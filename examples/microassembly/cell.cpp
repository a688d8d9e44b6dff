#include "cell.hpp"

namespace microassembly {

namespace {

/// Reads a property whenever its service has come, and forgets it when that has gone.
template <class Client, class Property, class T>
void keep_known(rr::ServiceSubscription& service, Property (Client::*property)() const, T& value) {
  service.on_connected([property, &value](const rr::AsyncObject& object) {
    (Client(object).*property)().get([&value](std::exception_ptr failure, T now) {
      if (!failure) value = std::move(now);
    });
  });
  service.on_lost([&value](const auto&, const auto&) { value.clear(); });
}

/// The place of a number in a list that is known.
template <class T>
auto& pick(T& list, std::int32_t index, const char* what) {
  if (list.empty())
    throw rr::ServiceException(std::string(what) + "s: their node is not there", rr::ErrorCode::invalid_operation);
  if (index < 0 || static_cast<std::size_t>(index) >= list.size())
    refuse(std::string(what) + " " + std::to_string(index) + ", expected 0 to " + std::to_string(list.size() - 1));
  return list[static_cast<std::size_t>(index)];
}

/// Sets a property to `wanted`. Where that is refused, it is what it was.
template <class Property, class T>
void set(Property property, T wanted, T& value) {
  property.set(wanted, [property, &value](std::exception_ptr failure) {
    if (failure)
      property.get([&value](std::exception_ptr again, T now) {
        if (!again) value = std::move(now);
      });
  });
  value = std::move(wanted);
}

}  // namespace

Cell::Cell(Finder& finder)
    : stages_(finder.subscribe("Stages")),
      stage_poses_(stages_.wire(&definition::StagesAsyncClient::poses)),
      cameras_(finder.subscribe("Cameras")),
      illuminators_(finder.subscribe("Illuminators")) {
  keep_known(stages_, &definition::StagesAsyncClient::targets, targets_);
  keep_known(cameras_, &definition::CamerasAsyncClient::focus, heights_);
  keep_known(illuminators_, &definition::IlluminatorsAsyncClient::levels, levels_);
  stage_poses_.on_value([this](Poses now) { poses(now); });
}

void Cell::publish() {
  std::string there;
  for (const auto* service : {&stages_, &cameras_, &illuminators_})
    if (const auto client = service->default_client())
      there += (there.empty() ? "" : " ") + client->connection()->session().service();
  parts(there);
}

void Cell::move(std::int32_t probe, Pose by) {
  auto targets = targets_;
  auto& target = pick(targets, probe, "probe");
  target = {target.x + by.x, target.y + by.y, target.z + by.z, target.theta + by.theta};
  if (!is_reachable(target)) refuse("the target is outside of the bench");
  set(definition::StagesAsyncClient(stages_.default_client().value()).targets(), std::move(targets), targets_);
}

void Cell::illuminate(std::int32_t illuminator, double level) {
  auto levels = levels_;
  pick(levels, illuminator, "illuminator") = level;
  check_numbers("levels", levels, illuminator_count, 0, 1);
  set(definition::IlluminatorsAsyncClient(illuminators_.default_client().value()).levels(), std::move(levels), levels_);
}

void Cell::focus(std::int32_t camera, double height) {
  auto heights = heights_;
  pick(heights, camera, "camera") = height;
  check_numbers("heights", heights, focus_count, 0, 2);
  set(definition::CamerasAsyncClient(cameras_.default_client().value()).focus(), std::move(heights), heights_);
}

void Cell::halt() {
  const auto client = stages_.default_client();
  if (!client) throw rr::ServiceException("the stages are not there", rr::ErrorCode::invalid_operation);
  const definition::StagesAsyncClient stages(*client);
  stages.halt([this, stages](std::exception_ptr failure) {
    if (!failure)
      stages.targets().get([this](std::exception_ptr again, Poses targets) {
        if (!again) targets_ = std::move(targets);
      });
  });
}

}  // namespace microassembly
