// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// Satellite 2 of the scenario `triangle` as a program of its own: rclcpp and satform's messages alone.
// The rules in brackets are those of docs/interface.md.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <rclcpp/rclcpp.hpp>
#include <satform_msgs/msg/arc_length.hpp>
#include <satform_msgs/msg/command.hpp>
#include <satform_msgs/msg/formation_status.hpp>
#include <satform_msgs/msg/node_ready.hpp>
#include <satform_msgs/msg/relative_state.hpp>
#include <satform_msgs/msg/tracking.hpp>

extern "C" {
#include "phase_law.h"
}

using satform_msgs::msg::ArcLength;
using satform_msgs::msg::Command;
using satform_msgs::msg::FormationStatus;
using satform_msgs::msg::NodeReady;
using satform_msgs::msg::RelativeState;
using satform_msgs::msg::Tracking;

namespace
{

const std::string own_name = "sat2";
const std::vector<std::string> neighbours = {"sat1", "sat3"};
constexpr std::uint32_t interface_version = 1;
constexpr int lost = 3;

std_msgs::msg::Header header_of(std::uint64_t step)
{
  std_msgs::msg::Header header;
  const std::uint64_t nanoseconds = step * STEP_NANOSECONDS;
  header.stamp.sec = static_cast<std::int32_t>(nanoseconds / 1000000000U);
  header.stamp.nanosec = static_cast<std::uint32_t>(nanoseconds % 1000000000U);
  header.frame_id = "lvlh";
  return header;
}

template<typename Vector>
void set(Vector & vector, const double values[3])
{
  vector.x = values[0];
  vector.y = values[1];
  vector.z = values[2];
}

class ForeignSatellite : public rclcpp::Node
{
public:
  ForeignSatellite()
  : Node(own_name), recorded_(declare_parameter("recorded", true))
  {
    const auto each_step = rclcpp::QoS(1000);  // reliable, volatile
    const auto latched = rclcpp::QoS(100).transient_local();
    command_ = create_publisher<Command>(own_name + "/command", each_step);
    phase_ = create_publisher<ArcLength>(own_name + "/arc_length", each_step);
    tracking_ = create_publisher<Tracking>(own_name + "/tracking", each_step);
    node_ready_ = create_publisher<NodeReady>("formation/node_ready", latched);
    for (const auto & name : neighbours) {
      phases_.push_back(create_subscription<ArcLength>(
        name + "/arc_length", each_step, [this, name](const ArcLength & message) {
          stored_[{message.step, name}] = Phase{message.arc_length, message.rate};
          act();
        }));
    }
    state_ = create_subscription<RelativeState>(
      own_name + "/state", each_step, [this](const RelativeState & message) {
        given_ = message;
        act();
      });
    status_ = create_subscription<FormationStatus>(
      "formation/status", latched, [this](const FormationStatus & message) { take_status(message); });
    timer_ = create_wall_timer(std::chrono::milliseconds(100), [this] { report_ready(); });
  }

  int exit_code = EXIT_SUCCESS;

private:
  // Report readiness once all endpoints are matched [R1, R2].
  void report_ready()
  {
    const std::size_t recorder = recorded_ ? 1 : 0;
    bool matched = state_->get_publisher_count() > 0 && status_->get_publisher_count() > 0;
    for (const auto & phase : phases_) {
      matched = matched && phase->get_publisher_count() > 0;
    }
    matched = matched && node_ready_->get_subscription_count() >= 1 &&
      command_->get_subscription_count() >= 1 + recorder &&
      phase_->get_subscription_count() >= neighbours.size() + recorder &&
      tracking_->get_subscription_count() >= recorder;
    if (!matched) {
      return;
    }
    NodeReady message;
    message.header = header_of(0);
    message.node = get_fully_qualified_name();
    message.checkpoint = -1;
    message.interface = interface_version;
    node_ready_->publish(message);
    timer_->cancel();
  }

  // Take up a status: the end [X1, X2], the own loss [L1], a repetition [S8].
  void take_status(const FormationStatus & message)
  {
    formation_ = message;
    const bool finished = message.phase == FormationStatus::FINISHED;
    if (finished || message.phase == FormationStatus::ABORTED || (step_ && !is_member())) {
      exit_code = finished ? EXIT_SUCCESS : lost;  // if it is lost, it rejoins when started again
      rclcpp::shutdown();
      return;
    }
    if (member_ && !is_member()) {
      timer_->reset();  // what it published before its loss is rejected [L2]
    }
    member_ = is_member();
    const auto & names = message.rejoined;
    rejoined_ = member_ && (rejoined_ || std::find(names.begin(), names.end(), own_name) != names.end());
    if (last_command_) {
      command_->publish(*last_command_);
    }
    for (const auto & phase : announced_) {
      phase_->publish(phase);
    }
    act();
  }

  bool is_member() const
  {
    for (std::size_t index = 0; index < formation_->satellites.size(); ++index) {
      if (formation_->satellites[index] == own_name) {
        return formation_->alive[index];
      }
    }
    return false;
  }

  // Publish the phase for a step [S1, S3].
  void announce(std::uint64_t step)
  {
    ArcLength message;
    message.header = header_of(step);
    message.step = step;
    message.arc_length = own_.arc_length;
    message.rate = own_.rate;
    if (announced_.size() == 2) {
      announced_.erase(announced_.begin());
    }
    announced_.push_back(message);
    phase_->publish(message);
  }

  // Phases of the members among the in-neighbours for the present step [F2]; none while one is missing [S2].
  std::optional<std::vector<Phase>> collect() const
  {
    std::vector<Phase> found;
    for (std::size_t edge = 0; edge < formation_->edge_receivers.size(); ++edge) {
      const auto sender = formation_->edge_senders[edge];
      if (formation_->satellites[formation_->edge_receivers[edge]] != own_name || !formation_->alive[sender]) {
        continue;
      }
      const auto stored = stored_.find({*step_, formation_->satellites[sender]});
      if (stored == stored_.end()) {
        return std::nullopt;
      }
      found.push_back(stored->second);
    }
    return found;
  }

  // Answer the state if its formation [F1] and all messages of its step are known [S2].
  void act()
  {
    if (!given_ || !formation_ || formation_->version < given_->formation_version ||
      given_->step == formation_->last_step)
    {
      return;
    }
    if (!step_) {  // begins at step 0, or at that of its return [L3]
      if (given_->step < formation_->step || !is_member() || !(given_->step == 0 || rejoined_)) {
        return;
      }
      step_ = given_->step;
      own_ = law_join(*step_);
      announce(*step_);
    }
    const auto phases = given_->step == *step_ ? collect() : std::nullopt;
    if (!phases) {
      return;
    }
    const double position[3] = {given_->position.x, given_->position.y, given_->position.z};
    const double velocity[3] = {given_->velocity.x, given_->velocity.y, given_->velocity.z};
    const Decision decision = law_act(&own_, position, velocity, phases->data(), phases->size());
    publish(decision);
    stored_.erase(stored_.begin(), stored_.lower_bound({*step_, ""}));
    announce(++*step_);
  }

  void publish(const Decision & decision)
  {
    Command command;
    command.header = header_of(*step_);
    command.step = *step_;
    set(command.acceleration, decision.acceleration);
    command.announced_at = header_of(*step_ + 1).stamp;
    command.announced_arc_length = own_.arc_length;
    command.announced_rate = own_.rate;
    command_->publish(command);
    last_command_ = command;
    Tracking tracking;
    tracking.header = header_of(*step_);
    tracking.step = *step_;
    set(tracking.reference_position, decision.reference_position);
    set(tracking.reference_velocity, decision.reference_velocity);
    set(tracking.reference_acceleration, decision.reference_acceleration);
    set(tracking.position_error, decision.position_error);
    set(tracking.velocity_error, decision.velocity_error);
    set(tracking.sliding_variable, decision.sliding_variable);
    tracking_->publish(tracking);
  }

  bool recorded_;
  bool member_ = false;
  bool rejoined_ = false;
  Phase own_{};
  std::optional<std::uint64_t> step_;
  std::optional<RelativeState> given_;
  std::optional<FormationStatus> formation_;
  std::optional<Command> last_command_;
  std::vector<ArcLength> announced_;
  std::map<std::pair<std::uint64_t, std::string>, Phase> stored_;
  rclcpp::Publisher<Command>::SharedPtr command_;
  rclcpp::Publisher<ArcLength>::SharedPtr phase_;
  rclcpp::Publisher<Tracking>::SharedPtr tracking_;
  rclcpp::Publisher<NodeReady>::SharedPtr node_ready_;
  std::vector<rclcpp::Subscription<ArcLength>::SharedPtr> phases_;
  rclcpp::Subscription<RelativeState>::SharedPtr state_;
  rclcpp::Subscription<FormationStatus>::SharedPtr status_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace

int main(int count, char * arguments[])
{
  rclcpp::init(count, arguments);
  const auto satellite = std::make_shared<ForeignSatellite>();
  rclcpp::spin(satellite);
  rclcpp::shutdown();
  return satellite->exit_code;
}
