// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// A participant on Fast DDS that reads and prints the same lines as that on Cyclone DDS, see cyclone_participant.c.
// The environment variable ENCLAVE is the folder with its keys; without it the participant has no security.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/common/SerializedPayload.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

struct Sample {
  std::string writer;
  uint32_t number = 0;
};

// The type of Sample.idl, as plain CDR in little-endian order.
class SampleType : public TopicDataType {
 public:
  SampleType() {
    setName("Sample");
    m_typeSize = 128;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }

  bool serialize(void *data, SerializedPayload_t *payload) override {
    const Sample &sample = *static_cast<Sample *>(data);
    const uint32_t length = static_cast<uint32_t>(sample.writer.size()) + 1;
    const uint32_t padded = (length + 3) / 4 * 4;
    if (12 + padded > payload->max_size) return false;
    const unsigned char header[4] = {0, CDR_LE, 0, 0};
    std::memset(payload->data, 0, 12 + padded);
    std::memcpy(payload->data, header, 4);
    std::memcpy(payload->data + 4, &length, 4);
    std::memcpy(payload->data + 8, sample.writer.data(), length - 1);
    std::memcpy(payload->data + 8 + padded, &sample.number, 4);
    payload->encapsulation = CDR_LE;
    payload->length = 12 + padded;
    return true;
  }

  bool deserialize(SerializedPayload_t *payload, void *data) override {
    uint32_t length = 0;
    if (payload->length < 12 || payload->data[1] != CDR_LE) return false;
    std::memcpy(&length, payload->data + 4, 4);
    const uint32_t padded = (length + 3) / 4 * 4;
    if (length == 0 || length > 64 || payload->length < 12 + padded) return false;
    Sample &sample = *static_cast<Sample *>(data);
    sample.writer.assign(reinterpret_cast<const char *>(payload->data + 8), length - 1);
    std::memcpy(&sample.number, payload->data + 8 + padded, 4);
    return true;
  }

  std::function<uint32_t()> getSerializedSizeProvider(void *data) override {
    const uint32_t length = static_cast<uint32_t>(static_cast<Sample *>(data)->writer.size()) + 1;
    return [length] { return 12 + (length + 3) / 4 * 4; };
  }

  void *createData() override { return new Sample; }
  void deleteData(void *data) override { delete static_cast<Sample *>(data); }
  bool getKey(void *, InstanceHandle_t *, bool) override { return false; }
};

// Wakes the main thread at every match and at every sample.
class Changes : public DomainParticipantListener {
 public:
  void on_data_on_readers(Subscriber *) override { notify(); }
  void on_data_available(DataReader *) override { notify(); }
  void on_publication_matched(DataWriter *, const PublicationMatchedStatus &) override { notify(); }
  void on_subscription_matched(DataReader *, const SubscriptionMatchedStatus &) override { notify(); }

  void wait_until(const std::function<bool()> &over, std::chrono::seconds longest) {
    const auto end = std::chrono::steady_clock::now() + longest;
    for (;;) {
      uint64_t seen;
      {
        std::lock_guard<std::mutex> guard(mutex_);
        seen = changes_;
      }
      if (over()) return;
      std::unique_lock<std::mutex> lock(mutex_);
      if (!changed_.wait_until(lock, end, [&] { return changes_ != seen; })) return;
    }
  }

 private:
  void notify() {
    std::lock_guard<std::mutex> guard(mutex_);
    changes_ += 1;
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  uint64_t changes_ = 0;
};

struct Endpoint {
  std::string kind;
  std::string topic;
  unsigned expected = 0;
  DataWriter *writer = nullptr;
  DataReader *reader = nullptr;
  std::map<std::string, unsigned> samples;

  unsigned matched() {
    PublicationMatchedStatus published;
    SubscriptionMatchedStatus subscribed;
    if (writer) writer->get_publication_matched_status(published);
    if (reader) reader->get_subscription_matched_status(subscribed);
    return static_cast<unsigned>(writer ? published.current_count : subscribed.current_count);
  }

  // Take what others have written.
  void take(const std::string &own) {
    Sample sample;
    SampleInfo info;
    while (reader && reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data && sample.writer != own) samples[sample.writer] += 1;
    }
  }
};

static void add(DomainParticipantQos &qos, const std::string &name, const std::string &value) {
  qos.properties().properties().emplace_back(name, value);
}

static DomainParticipantQos participant_qos(const char *enclave) {
  DomainParticipantQos qos;
  auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.push_back("127.0.0.1");
  transport->maxInitialPeersRange = 20;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  Locator_t loopback;
  IPLocator::setIPv4(loopback, 127, 0, 0, 1);
  qos.wire_protocol().builtin.initialPeersList.push_back(loopback);
  qos.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(loopback);
  if (enclave == nullptr) return qos;
  const std::string file = std::string("file://") + enclave + "/";
  add(qos, "dds.sec.auth.plugin", "builtin.PKI-DH");
  add(qos, "dds.sec.auth.builtin.PKI-DH.identity_ca", file + "identity_ca.cert.pem");
  add(qos, "dds.sec.auth.builtin.PKI-DH.identity_certificate", file + "cert.pem");
  add(qos, "dds.sec.auth.builtin.PKI-DH.private_key", file + "key.pem");
  add(qos, "dds.sec.access.plugin", "builtin.Access-Permissions");
  add(qos, "dds.sec.access.builtin.Access-Permissions.permissions_ca", file + "permissions_ca.cert.pem");
  add(qos, "dds.sec.access.builtin.Access-Permissions.governance", file + "governance.p7s");
  add(qos, "dds.sec.access.builtin.Access-Permissions.permissions", file + "permissions.p7s");
  add(qos, "dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  return qos;
}

class Program {
 public:
  Program(DomainParticipant *participant, Changes &changes, std::string name, std::chrono::seconds longest)
      : participant_(participant), changes_(changes), name_(std::move(name)), longest_(longest) {
    type_.register_type(participant_);
    publisher_ = participant_->create_publisher(PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  }

  void act(const std::string &line) {
    std::istringstream words(line);
    std::string what, topic;
    unsigned number = 0;
    words >> what;
    if (what == "publish" || what == "subscribe") {
      words >> topic >> number;
      make(what, topic, number);
      return;
    }
    words >> number;
    if (what == "match") match();
    if (what == "write") write(number);
    if (what == "receive") receive(number);
    std::cout << "done" << std::endl;
  }

 private:
  void make(const std::string &kind, const std::string &name, unsigned expected) {
    Endpoint made;
    made.kind = kind;
    made.topic = name;
    made.expected = expected;
    Topic *&topic = topics_[name];
    if (topic == nullptr) topic = participant_->create_topic(name, "Sample", TOPIC_QOS_DEFAULT);
    if (topic != nullptr && kind == "publish") {
      DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
      qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
      qos.history().kind = KEEP_ALL_HISTORY_QOS;
      made.writer = publisher_->create_datawriter(topic, qos);
    } else if (topic != nullptr) {
      DataReaderQos qos = DATAREADER_QOS_DEFAULT;
      qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
      qos.history().kind = KEEP_ALL_HISTORY_QOS;
      made.reader = subscriber_->create_datareader(topic, qos);
    }
    const bool refused = made.writer == nullptr && made.reader == nullptr;
    std::cout << (refused ? "refused " : "made ") << kind << " " << name << (refused ? " no reason given" : "")
              << std::endl;
    if (!refused) endpoints_.push_back(made);
  }

  // Remote endpoints: Fast DDS 2.9 also matches a writer and a reader of one participant.
  unsigned peers(Endpoint &one) {
    bool both = false;
    for (const Endpoint &other : endpoints_) both |= other.topic == one.topic && other.kind != one.kind;
    const unsigned matched = one.matched();
    return matched - (both && matched ? 1 : 0);
  }

  void match() {
    changes_.wait_until(
        [this] {
          bool over = true;
          for (Endpoint &one : endpoints_) over &= peers(one) >= one.expected;
          return over;
        },
        longest_);
    for (Endpoint &one : endpoints_) {
      std::cout << "matched " << one.kind << " " << one.topic << " " << peers(one) << "\n";
    }
  }

  void write(unsigned samples) {
    Sample sample;
    sample.writer = name_;
    for (unsigned round = 0; round < samples; round++, sample.number++) {
      for (Endpoint &one : endpoints_) {
        if (one.writer && !one.writer->write(&sample)) std::cout << "not written " << one.topic << "\n";
      }
    }
  }

  void receive(unsigned each) {
    changes_.wait_until(
        [this, each] {
          bool over = true;
          for (Endpoint &one : endpoints_) {
            one.take(name_);
            unsigned complete = 0;
            for (const auto &entry : one.samples) complete += entry.second >= each;
            over &= one.writer != nullptr || complete >= one.expected;
          }
          return over;
        },
        longest_);
    for (const Endpoint &one : endpoints_) {
      for (const auto &entry : one.samples) {
        std::cout << "received " << one.topic << " " << entry.first << " " << entry.second << "\n";
      }
    }
  }

  DomainParticipant *participant_;
  Changes &changes_;
  std::string name_;
  std::chrono::seconds longest_;
  TypeSupport type_{new SampleType()};
  Publisher *publisher_ = nullptr;
  Subscriber *subscriber_ = nullptr;
  std::map<std::string, Topic *> topics_;
  std::deque<Endpoint> endpoints_;
};

int main(int arguments, char **argument) {
  if (arguments != 4) return 2;
  // What Fast DDS reports goes to the standard error output.
  Log::ClearConsumers();
  Log::RegisterConsumer(std::make_unique<StdoutErrConsumer>());
  Changes changes;
  DomainParticipant *participant = DomainParticipantFactory::get_instance()->create_participant(
      static_cast<uint32_t>(std::atoi(argument[1])), participant_qos(std::getenv("ENCLAVE")), &changes,
      StatusMask::all());
  if (participant == nullptr) {
    std::cout << "refused participant" << std::endl;
    return 0;
  }
  std::cout << "joined" << std::endl;
  {
    Program program(participant, changes, argument[2], std::chrono::seconds(std::atoi(argument[3])));
    for (std::string line; std::getline(std::cin, line);) program.act(line);
  }
  participant->set_listener(nullptr);
  participant->delete_contained_entities();
  DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
