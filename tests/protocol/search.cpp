// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
//
// Compiled search of the protocol explorer: the same actions in the same order as protocol_actions.py, the same
// following states as protocol_transitions.py, on states of small integers. What a process does with an input is
// asked of Python once, and remembered. Of visited states the 64-bit fingerprints are stored.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <stdexcept>
#include <unordered_map>
#include <vector>

namespace {

using Ints = std::vector<int32_t>;

enum Kind { LOST, STATUS, READY, STATE, ANNOUNCEMENT, COMMAND };
enum Fault { DELAY = 1, DUPLICATE = 2, KILL = 4, SILENT = 8, GRAPH = 16, PAUSE = 32, STEP = 64 };
enum Event { PUT_STATUS, PUT_STATE, PUT_COMMAND, PUT_ANNOUNCEMENT, PUT_READY, ACTED, REPORTS_READ, OTHER };
enum What { DELIVER, RELEASE, RESUME, IDLE, TIMEOUT, RESTART, DO_DELAY, DO_DUPLICATE, DO_KILL, DO_SILENT, DO_GRAPH,
            DO_PAUSE, DO_STEP, DO_CUT, DO_DEFER };
enum Input { GIVEN_MESSAGE, GIVEN_RESUME, GIVEN_RETRANSMIT, GIVEN_TIMEOUT, GIVEN_SILENT, GIVEN_GRAPH, GIVEN_PAUSE,
             GIVEN_STEP, GIVEN_BEGIN };

struct Action {
    int what, a, b;
};

// Asks Python; answers are written to the buffer. Negative: an invariant does not hold.
using Ask = int (*)(int question, int one, int two, int three, int four, const int32_t *more, int32_t *answer);
enum Question { REACTION, INPUT, PLANT, SATELLITE, STAMPED, VIEW, NEW_PROCESS };

struct Reaction {
    int next = 0;
    bool broken = false, ends = false, stores = false, old = false;
    std::vector<std::array<int, 3>> events;
};

struct PlantFacts {
    bool known = false, flying = false, paused = false, last = false;
    int progress = 0, awaited = 0, missing = 0, alive = 0;
    Ints statuses;
};

struct SatelliteFacts {
    bool known = false, flying = false;
    int disk = 0;
};

struct Broken {};

uint64_t mixed(uint64_t a, uint64_t b) {
    const unsigned __int128 product = static_cast<unsigned __int128>(a ^ 0x9e3779b97f4a7c15ULL) * (b ^ 0xd6e8feb86659fd93ULL);
    return static_cast<uint64_t>(product) ^ static_cast<uint64_t>(product >> 64);
}

struct Hash {
    size_t operator()(const Ints &values) const {
        uint64_t hash = values.size() * 0xa0761d6478bd642fULL + 1;
        for (int32_t value : values) hash = mixed(hash, static_cast<uint32_t>(value) + 0x1000000000ULL);
        return hash;
    }
};

// Numbers by keys of 64 bits, of which none is the largest one.
class Numbers {
  public:
    Numbers() : keys_(1 << 10, NO_KEY), values_(1 << 10) {}
    // Where the number of a key is; null if there is none.
    const int *find(uint64_t key) const {
        for (size_t slot = mixed(key, 1) & (keys_.size() - 1);; slot = (slot + 1) & (keys_.size() - 1)) {
            if (keys_[slot] == key) return &values_[slot];
            if (keys_[slot] == NO_KEY) return nullptr;
        }
    }
    int add(uint64_t key, int value) {
        if (++count_ * 2 > keys_.size()) grow();
        place(key, value);
        return value;
    }

  private:
    static constexpr uint64_t NO_KEY = UINT64_MAX;
    void place(uint64_t key, int value) {
        size_t slot = mixed(key, 1) & (keys_.size() - 1);
        while (keys_[slot] != NO_KEY) slot = (slot + 1) & (keys_.size() - 1);
        keys_[slot] = key;
        values_[slot] = value;
    }
    void grow() {
        std::vector<uint64_t> keys(keys_.size() * 2, NO_KEY);
        std::vector<int> values(keys.size());
        keys.swap(keys_);
        values.swap(values_);
        for (size_t slot = 0; slot < keys.size(); slot++)
            if (keys[slot] != NO_KEY) place(keys[slot], values[slot]);
    }
    std::vector<uint64_t> keys_;
    std::vector<int> values_;
    size_t count_ = 0;
};

uint64_t both_of(int one, int two) { return static_cast<uint64_t>(static_cast<uint32_t>(one)) << 32 | static_cast<uint32_t>(two); }

// Sequences of integers by number; number 0 is the empty one.
class Sequences {
  public:
    Sequences() { number({}); }
    int number(const Ints &values) {
        auto [place, fresh] = numbers_.try_emplace(values, static_cast<int>(all_.size()));
        if (fresh) all_.push_back(values);
        return place->second;
    }
    const Ints &at(int number) const { return all_[number]; }
    int pushed(int sequence, int value) {
        const uint64_t key = both_of(sequence, value);
        if (const int *known = pushed_.find(key)) return *known;
        Ints longer = all_[sequence];
        longer.push_back(value);
        return pushed_.add(key, number(longer));
    }
    int popped(int sequence) {
        if (const int *known = popped_.find(static_cast<uint64_t>(sequence))) return *known;
        return popped_.add(static_cast<uint64_t>(sequence), number(Ints(all_[sequence].begin() + 1, all_[sequence].end())));
    }
    int prefix(int sequence, size_t length) {
        return number(Ints(all_[sequence].begin(), all_[sequence].begin() + length));
    }

  private:
    std::vector<Ints> all_;
    std::unordered_map<Ints, int, Hash> numbers_;
    Numbers pushed_, popped_;
};

}  // namespace

// All states are arrays of `width` integers: plant, satellites (-1 - checkpoint of an ended one), messages of each
// channel, held messages, disturbances left, progress when all published again, processes started and last steps
// acted in of each satellite. In the third reduction also: channels on which nothing more is sent, and by bits which
// process is to be killed, whose command arrives after the report of its end, which processes were killed.
//
// The third reduction chooses what a kill does to a message when this message is due, not at the kill. A satellite is
// doomed by `cut` (this message of it and those after it on this channel do not arrive) or `defer` (its commands arrive
// after the report of its end), and killed at a later time; of a killed one the last messages may be cut. Each such
// history is one of a kill, in which the messages were on their way. So a message that its receiver only stores need not
// wait for all that may happen before: delivered, delayed, repeated, cut or deferred is enough.
class Search {
  public:
    Search(int count, int channels, const int32_t *table, int faults, int restarts, int reduction, Ask ask)
        : count_(count), channels_(channels), faults_(faults), restarts_(restarts), reduction_(reduction), ask_(ask),
          first_channel_(1 + count), held_(first_channel_ + channels), budget_(held_ + 1), waiting_(held_ + 2),
          started_(held_ + 3), acted_(started_ + count), closed_(acted_ + count), fate_(closed_ + 1), width_(fate_ + 1),
          answer_(1 << 16) {
        for (int place = 0; place < channels; place++) {
            kinds_.push_back(table[3 * place]);
            from_.push_back(table[3 * place + 1]);
            to_.push_back(table[3 * place + 2]);
            places_[kinds_[place]][1 + from_[place]][1 + to_[place]] = place;
        }
    }

    int width() const { return width_; }

    // Messages of a channel in the first state, which Python makes.
    int sequence(const int32_t *values, int length) { return queues_.number(Ints(values, values + length)); }

    int explore(const int32_t *first, uint64_t limit, uint64_t *figures) {
        limit_ = limit;
        prints_.clear();
        table_.assign(1 << 16, 0);
        Ints level(first, first + width_), next;
        visit(first, 0, 0);
        uint64_t number = 0;
        while (!level.empty()) {
            next.clear();
            for (size_t at = 0; at < level.size(); at += width_, number++) {
                try {
                    expand(number, &level[at], next);
                } catch (const Broken &) {
                    return finish(figures, 1, number);
                }
                if (prints_.size() > limit_) return finish(figures, 3, number);
            }
            level.swap(next);
            levels_.push_back(prints_.size());
            frontier_ = std::max<uint64_t>(frontier_, level.size() / width_);
        }
        const int64_t stuck = stuck_state();
        return stuck < 0 ? finish(figures, 0, 0) : finish(figures, 4, static_cast<uint64_t>(stuck));
    }

    // Numbers of the actions that lead from the first state to a visited one.
    int history(uint64_t number, int32_t *actions) {
        Ints found;
        while (number) {
            found.push_back(by_[number]);
            number = parents_[number];
        }
        std::reverse(found.begin(), found.end());
        std::copy(found.begin(), found.end(), actions);
        return static_cast<int>(found.size());
    }

    // Random walks; `actions` has those of the last walk.
    int walk(const int32_t *first, uint64_t seed, int walks, int disturbed, uint64_t *figures, int32_t *actions) {
        uint64_t random = seed;
        for (int each = 0; each < walks; each++) {
            Ints state(first, first + width_), after(width_);
            length_ = 0;
            while (!over(state.data())) {
                everything(state.data());
                const int chosen = drawn(random, disturbed);
                actions[length_++] = chosen;
                transitions_++;
                try {
                    follow(state.data(), found_[chosen], after.data());
                } catch (const Broken &) {
                    return finish(figures, 1, length_);
                }
                state.swap(after);
                if (length_ > 5000) return finish(figures, 4, length_);
            }
            ends_++;
        }
        return finish(figures, 0, 0);
    }

    const std::vector<int> &ended() const { return ended_; }

  private:
    int finish(uint64_t *figures, int outcome, uint64_t number) {
        figures[0] = prints_.size();
        figures[1] = transitions_;
        figures[2] = ends_;
        figures[3] = number;
        figures[4] = by_now_;
        figures[5] = frontier_;
        figures[6] = levels_.size();
        return outcome;
    }

    uint64_t next_random(uint64_t &random) {
        uint64_t value = (random += 0x9e3779b97f4a7c15ULL);
        value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ULL;
        value = (value ^ (value >> 27)) * 0x94d049bb133111ebULL;
        return value ^ (value >> 31);
    }

    int drawn(uint64_t &random, int disturbed) {
        Ints calm, others;
        for (size_t each = 0; each < found_.size(); each++)
            (found_[each].what <= TIMEOUT ? calm : others).push_back(static_cast<int>(each));
        const bool disturb = !others.empty() && (calm.empty() || next_random(random) % 1000 < static_cast<uint64_t>(disturbed));
        const Ints &from = disturb ? others : calm;
        return from[next_random(random) % from.size()];
    }

    // Visited states

    uint64_t fingerprint(const int32_t *state) const {
        uint64_t hash = 0x2545f4914f6cdd1dULL;
        for (int at = 0; at < width_; at++) hash = mixed(hash, static_cast<uint32_t>(state[at]) + (static_cast<uint64_t>(at + 1) << 40));
        return mixed(hash, hash >> 7 | 1);
    }

    // Number of a state, and whether it is new.
    std::pair<uint64_t, bool> visit(const int32_t *state, uint64_t parent, int action) {
        if ((prints_.size() + 1) * 3 > table_.size() * 2) grow();
        const uint64_t print = fingerprint(state);
        uint64_t slot = print & (table_.size() - 1);
        while (table_[slot]) {
            if (prints_[table_[slot] - 1] == print) return {table_[slot] - 1, false};
            slot = (slot + 1) & (table_.size() - 1);
        }
        prints_.push_back(print);
        table_[slot] = static_cast<uint32_t>(prints_.size());
        parents_.push_back(static_cast<uint32_t>(parent));
        by_.push_back(static_cast<uint16_t>(action));
        calm_.push_back(0);
        return {prints_.size() - 1, true};
    }

    void grow() {
        std::vector<uint32_t>().swap(table_);
        size_t size = 1 << 16;
        while (size * 2 < (prints_.size() + 1) * 6) size *= 2;
        table_.assign(size, 0);
        for (size_t number = 0; number < prints_.size(); number++) {
            uint64_t slot = prints_[number] & (size - 1);
            while (table_[slot]) slot = (slot + 1) & (size - 1);
            table_[slot] = static_cast<uint32_t>(number + 1);
        }
    }

    // Visits what follows from a state.
    void expand(uint64_t number, const int32_t *state, Ints &next) {
        by_now_ = 0;
        if (over(state)) {
            calm_[number] = ENDED;
            ends_++;
            if (std::find(ended_.begin(), ended_.end(), state[0]) == ended_.end()) ended_.push_back(state[0]);
            return;
        }
        const std::vector<Action> actions = possible(state);
        Ints after(width_);
        bool calm = false;
        for (size_t each = 0; each < actions.size(); each++) {
            transitions_++;
            by_now_ = each;
            follow(state, actions[each], after.data());
            const auto [reached, fresh] = visit(after.data(), number, static_cast<int>(each));
            if (fresh) next.insert(next.end(), after.begin(), after.end());
            if (!calm && (actions.size() == 1 || goes_on_by(state, actions[each]))) {
                calm = true;
                calm_[number] = static_cast<uint32_t>(reached + 1);
            }
        }
    }

    bool goes_on_by(const int32_t *state, const Action &action) {
        if (action.what == RESTART) return plant(state[0]).awaited >> action.a & 1;
        if (action.what == DO_KILL) return doomed(state, action.a);
        return action.what == DELIVER || action.what == RESUME || action.what == IDLE || action.what == TIMEOUT;
    }

    // A state from which the flight does not end without disturbance; -1 if there is none.
    int64_t stuck_state() {
        std::vector<bool> ending(prints_.size()), chained(prints_.size());
        std::vector<uint32_t> chain;
        for (uint64_t first = 0; first < prints_.size(); first++) {
            chain.clear();
            uint64_t state = first;
            while (!ending[state] && calm_[state] != ENDED) {
                if (chained[state] || calm_[state] == 0) return static_cast<int64_t>(first);
                chained[state] = true;
                chain.push_back(static_cast<uint32_t>(state));
                state = calm_[state] - 1;
            }
            for (uint32_t each : chain) {
                ending[each] = true;
                chained[each] = false;
            }
        }
        return -1;
    }

    // Facts about processes

    const PlantFacts &plant(int number) {
        if (static_cast<size_t>(number) >= plants_.size()) plants_.resize(number + 1024);
        PlantFacts &facts = plants_[number];
        if (facts.known) return facts;
        ask(PLANT, number, 0, 0, 0, nullptr);
        const Ints &got = answer_;
        facts.known = true;
        facts.flying = got[0];
        facts.paused = got[1];
        facts.last = got[2];
        facts.progress = got[3];
        facts.awaited = got[4];
        facts.missing = got[5];
        facts.alive = got[6];
        facts.statuses.assign(got.begin() + 8, got.begin() + 8 + got[7]);
        return facts;
    }

    const SatelliteFacts &satellite(int number) {
        if (static_cast<size_t>(number) >= satellites_.size()) satellites_.resize(number + 1024);
        SatelliteFacts &facts = satellites_[number];
        if (!facts.known) {
            ask(SATELLITE, number, 0, 0, 0, nullptr);
            facts.known = true;
            facts.flying = answer_[0];
            facts.disk = answer_[1];
        }
        return facts;
    }

    int ask(int question, int one, int two, int three, int four, const int32_t *more) {
        const int result = ask_(question, one, two, three, four, more, answer_.data());
        if (result < 0) throw Broken();
        return result;
    }

    // An answer that is a number, remembered.
    int asked(int question, int one, int two, int three, int four, const int32_t *more = nullptr) {
        const Ints key{question, one, two, three, four};
        auto known = asked_.find(key);
        if (known != asked_.end()) return known->second;
        const int result = ask(question, one, two, three, four, more);
        return asked_[key] = result;
    }

    const Reaction &react(int process, int input) {
        const uint64_t key = both_of(process, input);
        if (const int *known = reaction_numbers_.find(key)) return reactions_[*known];
        Reaction reaction;
        if (ask_(REACTION, process, input, 0, 0, nullptr, answer_.data()) < 0) {
            reaction.broken = true;
        } else {
            reaction.next = answer_[0];
            reaction.ends = answer_[1];
            reaction.old = answer_[2];
            for (int each = 0; each < answer_[3]; each++)
                reaction.events.push_back({answer_[4 + 3 * each], answer_[5 + 3 * each], answer_[6 + 3 * each]});
            reaction.stores = reaction.events.empty() && !reaction.ends;
        }
        reaction_numbers_.add(key, static_cast<int>(reactions_.size()));
        reactions_.push_back(std::move(reaction));
        return reactions_.back();
    }

    // What is given to a process by a message of a channel.
    int message_input(const int32_t *state, int place, int message) {
        if (kinds_[place] == LOST) {
            const int lost = asked(STAMPED, -1, message, 0, 0);
            const int present = state[1 + lost] < 0 ? -1 : state[started_ + lost];
            return asked(INPUT, GIVEN_MESSAGE, place, message, present);
        }
        if (kinds_[place] == READY) {
            const int reports = state[first_channel_];
            Ints content{static_cast<int32_t>(queues_.at(reports).size())};
            content.insert(content.end(), queues_.at(reports).begin(), queues_.at(reports).end());
            return asked(INPUT, GIVEN_MESSAGE, place, message, reports, content.data());
        }
        const uint64_t key = both_of(place, message);
        if (const int *known = inputs_.find(key)) return *known;
        return inputs_.add(key, asked(INPUT, GIVEN_MESSAGE, place, message, 0));
    }

    int receiver(int place) const {
        const int kind = kinds_[place];
        return kind == ANNOUNCEMENT || kind == STATE || kind == STATUS ? 1 + to_[place] : 0;
    }

    bool over(const int32_t *state) { return !plant(state[0]).flying; }

    int head(const int32_t *state, int place) const { return queues_.at(state[first_channel_ + place])[0]; }

    // Actions

    std::vector<Action> possible(const int32_t *state) {
        found_.clear();
        if (reduction_ && enough(state)) return found_;
        everything(state);
        return found_;
    }

    bool enough(const int32_t *state) {
        const Ints &held = held_messages(state);
        for (size_t each = 0; each < held.size(); each += 2) {
            const int who = receiver(held[each]);
            if (changes_nothing(state[who], kinds_[held[each]], message_input(state, held[each], held[each + 1]))) {
                found_.push_back({RELEASE, held[each], held[each + 1]});
                return true;
            }
        }
        for (int place = 0; place < channels_; place++) {
            const int kind = kinds_[place];
            if (!state[first_channel_ + place] || kind == LOST || kind == READY || blocked(state, place)) continue;
            const int who = receiver(place), input = message_input(state, place, head(state, place));
            if (changes_nothing(state[who], kind, input)) {
                found_.push_back({DELIVER, place, 0});
                return true;
            }
            if (only_stores(state, who, place, input)) {
                found_.push_back({DELIVER, place, 0});
                if (state[budget_] && unordered(kind)) {
                    if (faults_ & DELAY) found_.push_back({DO_DELAY, place, 0});
                    if (faults_ & DUPLICATE) found_.push_back({DO_DUPLICATE, place, 0});
                    if (kind == COMMAND && faults_ & SILENT) found_.push_back({DO_SILENT, from_[place], 0});
                }
                if (may_cut(state, place)) found_.push_back({DO_CUT, place, 0});
                if (kind == COMMAND && reduction_ == 2 && may_kill(state, from_[place])) found_.push_back({DO_DEFER, place, 0});
                return true;
            }
        }
        return false;
    }

    static bool unordered(int kind) { return kind == STATE || kind == ANNOUNCEMENT || kind == COMMAND || kind == READY; }

    bool changes_nothing(int process, int kind, int input) {
        if (kind == READY) return false;
        const Reaction &reaction = react(process, input);
        return reaction.stores && reaction.next == process && reaction.old;
    }

    bool only_stores(const int32_t *state, int who, int place, int input) {
        const Reaction &reaction = react(state[who], input);
        if (!reaction.stores || reaction.next == state[who]) return false;
        const int kind = kinds_[place], sender = from_[place];
        const bool sent = kind == ANNOUNCEMENT || kind == COMMAND;
        if (sent && reduction_ == 1 && may_kill(state, sender)) return false;
        if (!commutes(state, who, input)) return false;
        return kind != COMMAND || (state[1 + sender] >= 0 && !reported_lost(state, sender));
    }

    // What a kill may do

    bool doomed(const int32_t *state, int sender) const { return state[fate_] >> sender & 1; }

    bool may_kill(const int32_t *state, int sender) const {
        return faults_ & KILL && state[1 + sender] >= 0 && (state[budget_] || doomed(state, sender));
    }

    bool blocked(const int32_t *state, int place) const { return kinds_[place] == COMMAND && state[fate_] >> (8 + from_[place]) & 1; }

    int killed_bit(int sender, int incarnation) const { return 1 << (16 + 2 * sender + incarnation); }

    // Whether the next message of a channel may be lost by a kill of its sender, with those after it.
    bool may_cut(const int32_t *state, int place) {
        const int kind = kinds_[place], sender = from_[place];
        if (reduction_ != 2 || !(kind == ANNOUNCEMENT || kind == COMMAND || kind == READY)) return false;
        const int incarnation = asked(STAMPED, -3, head(state, place), 0, 0);
        if (state[1 + sender] >= 0 && incarnation == state[started_ + sender]) return may_kill(state, sender);
        return state[fate_] & killed_bit(sender, incarnation);
    }

    void doom(int32_t *state, int sender) {
        if (doomed(state, sender)) return;
        state[fate_] |= 1 << sender;
        state[budget_]--;
        state[waiting_] = -1;
    }

    void cut(int32_t *state, int place) {
        const int sender = from_[place], incarnation = asked(STAMPED, -3, head(state, place), 0, 0);
        Ints left;
        for (int message : queues_.at(state[first_channel_ + place]))
            if (asked(STAMPED, -3, message, 0, 0) != incarnation) left.push_back(message);
        state[first_channel_ + place] = queues_.number(left);
        if (state[1 + sender] >= 0 && incarnation == state[started_ + sender]) {
            doom(state, sender);
            state[closed_] |= 1 << place;
        }
    }

    // The report of a satellite's end has been read: its deferred commands may arrive.
    void report_read(int32_t *state, int sender) {
        if (state[1 + sender] < 0 || !doomed(state, sender)) state[fate_] &= ~(1 << (8 + sender));
    }

    bool reported_lost(const int32_t *state, int sender) {
        for (int message : queues_.at(state[first_channel_]))
            if (asked(STAMPED, -1, message, 0, 0) == sender) return true;
        return false;
    }

    bool commutes(const int32_t *state, int who, int input) {
        for (int place = 0; place < channels_; place++)
            if (receiver(place) == who && state[first_channel_ + place] && !commute(state, who, input, place, head(state, place))) return false;
        const Ints held = held_messages(state);
        for (size_t each = 0; each < held.size(); each += 2)
            if (receiver(held[each]) == who && !commute(state, who, input, held[each], held[each + 1])) return false;
        return true;
    }

    bool commute(const int32_t *state, int who, int input, int place, int message) {
        const int other = message_input(state, place, message);
        if (other == input) return true;
        Numbers &known = commuting_[state[who] & 0xff];
        if (input >= 1 << 20 || other >= 1 << 20) throw std::length_error("too many inputs");
        const uint64_t key = (static_cast<uint64_t>(state[who] >> 8) << 20 | static_cast<uint64_t>(input)) << 20 | static_cast<uint64_t>(other);
        if (const int *result = known.find(key)) return *result;
        const Ints one = both(state[who], input, other), two = both(state[who], other, input);
        return known.add(key, !one.empty() && one == two);
    }

    // What follows from two inputs one after another, as numbers; empty if an invariant does not hold then.
    Ints both(int process, int one, int other) {
        const Reaction &first = react(process, one);
        if (first.broken) return {};
        Ints result{first.next, first.ends};
        append_events(result, first);
        if (first.ends) return result;
        const Reaction &second = react(first.next, other);
        if (second.broken) return {};
        result[0] = second.next;
        result[1] = second.ends;
        append_events(result, second);
        return result;
    }

    static void append_events(Ints &result, const Reaction &reaction) {
        for (const auto &event : reaction.events) result.insert(result.end(), event.begin(), event.end());
    }

    const Ints &held_messages(const int32_t *state) const { return helds_.at(state[held_]); }

    void everything(const int32_t *state) {
        found_.clear();
        const PlantFacts &facts = plant(state[0]);
        bool calm = !(state[fate_] & 0xff);
        for (int place = 0; place < channels_; place++)
            if (state[first_channel_ + place]) {
                calm = false;
                if (!blocked(state, place)) found_.push_back({DELIVER, place, 0});
            }
        const Ints &held = held_messages(state);
        for (size_t each = 0; each < held.size(); each += 2)
            if (!each || held[each] != held[each - 2] || held[each + 1] != held[each - 1]) found_.push_back({RELEASE, held[each], held[each + 1]});
        if (facts.paused) found_.push_back({RESUME, 0, 0});
        else if (calm) found_.push_back({state[waiting_] != facts.progress ? IDLE : TIMEOUT, 0, 0});
        for (int each = 0; each < count_; each++)
            if (state[1 + each] < 0 && state[started_ + each] < restarts_) found_.push_back({RESTART, each, 0});
        if (state[budget_]) disturbances(state, facts);
        if (reduction_ == 2) ends(state);
    }

    // What ends of processes may do, in the third reduction.
    void ends(const int32_t *state) {
        for (int each = 0; each < count_; each++)
            if (may_kill(state, each)) found_.push_back({DO_KILL, each, -1});
        for (int place = 0; place < channels_; place++) {
            if (!state[first_channel_ + place] || blocked(state, place)) continue;
            if (may_cut(state, place)) found_.push_back({DO_CUT, place, 0});
            if (kinds_[place] == COMMAND && may_kill(state, from_[place])) found_.push_back({DO_DEFER, place, 0});
        }
    }

    void disturbances(const int32_t *state, const PlantFacts &facts) {
        for (int place = 0; place < channels_; place++)
            if (state[first_channel_ + place] && unordered(kinds_[place])) {
                if (faults_ & DELAY) found_.push_back({DO_DELAY, place, 0});
                if (faults_ & DUPLICATE) found_.push_back({DO_DUPLICATE, place, 0});
            }
        for (int each = 0; each < count_; each++)
            if (state[1 + each] >= 0 && faults_ & KILL && reduction_ != 2) {
                int choices = 1;
                for (int place : own_channels(state, each)) choices *= static_cast<int>(queues_.at(state[first_channel_ + place]).size()) + 1;
                for (int choice = 0; choice < choices; choice++) found_.push_back({DO_KILL, each, choice});
            }
        if (!facts.awaited && faults_ & SILENT)
            for (int each = 0; each < count_; each++)
                if (facts.missing >> each & 1) found_.push_back({DO_SILENT, each, 0});
        if (!facts.last && faults_ & GRAPH) found_.push_back({DO_GRAPH, 0, 0});
        if (facts.paused ? faults_ & STEP : faults_ & PAUSE) found_.push_back({facts.paused ? DO_STEP : DO_PAUSE, 0, 0});
    }

    Ints own_channels(const int32_t *state, int sender) const {
        Ints own;
        for (int place = 0; place < channels_; place++)
            if (from_[place] == sender && state[first_channel_ + place] && (kinds_[place] == ANNOUNCEMENT || kinds_[place] == COMMAND || kinds_[place] == READY)) own.push_back(place);
        return own;
    }

    // What follows from an action

    void follow(const int32_t *before, const Action &action, int32_t *state) {
        std::memcpy(state, before, sizeof(int32_t) * width_);
        switch (action.what) {
            case DELIVER: {
                const int message = head(state, action.a);
                int32_t &channel = state[first_channel_ + action.a];
                channel = queues_.popped(channel);
                const int input = message_input(state, action.a, message);
                if (kinds_[action.a] == LOST) report_read(state, asked(STAMPED, -1, message, 0, 0));
                return apply(state, receiver(action.a), input);
            }
            case RELEASE: {
                state[held_] = without(state[held_], action.a, action.b);
                return apply(state, receiver(action.a), message_input(state, action.a, action.b));
            }
            case RESUME: return apply(state, 0, asked(INPUT, GIVEN_RESUME, 0, 0, 0));
            case IDLE: {
                state[waiting_] = plant(state[0]).progress;
                for (int who = 0; who <= count_; who++)
                    if (!who || state[who] >= 0) apply(state, who, asked(INPUT, GIVEN_RETRANSMIT, 0, 0, 0));
                return;
            }
            case TIMEOUT: return time_out(state);
            case RESTART: return restart(state, action.a);
            case DO_CUT: return cut(state, action.a);
            case DO_DEFER:
                doom(state, from_[action.a]);
                state[fate_] |= 1 << (8 + from_[action.a]);
                return;
        }
        if (action.what == DO_KILL && action.b < 0) {
            doom(state, action.a);
            return end(state, action.a);
        }
        state[budget_]--;
        state[waiting_] = -1;
        disturb(state, action);
    }

    void disturb(int32_t *state, const Action &action) {
        switch (action.what) {
            case DO_DELAY:
            case DO_DUPLICATE: {
                int32_t &channel = state[first_channel_ + action.a];
                state[held_] = with(state[held_], action.a, queues_.at(channel)[0]);
                if (action.what == DO_DELAY) channel = queues_.popped(channel);
                return;
            }
            case DO_KILL: {
                int choice = action.b;
                const Ints own = own_channels(state, action.a);
                for (size_t each = own.size(); each-- > 0;) {
                    int32_t &channel = state[first_channel_ + own[each]];
                    const int length = static_cast<int>(queues_.at(channel).size());
                    channel = queues_.prefix(channel, length - choice % (length + 1));
                    choice /= length + 1;
                }
                return end(state, action.a);
            }
            case DO_SILENT: return apply(state, 0, asked(INPUT, GIVEN_SILENT, action.a, 0, 0));
            case DO_GRAPH: return apply(state, 0, asked(INPUT, GIVEN_GRAPH, 0, 0, 0));
            case DO_PAUSE: return apply(state, 0, asked(INPUT, GIVEN_PAUSE, 0, 0, 0));
            case DO_STEP: return apply(state, 0, asked(INPUT, GIVEN_STEP, 0, 0, 0));
        }
    }

    int with(int held, int place, int message) {
        std::vector<std::pair<int, int>> items = pairs(held);
        items.insert(std::upper_bound(items.begin(), items.end(), std::make_pair(place, message)), {place, message});
        return helds_.number(flat(items));
    }

    int without(int held, int place, int message) {
        std::vector<std::pair<int, int>> items = pairs(held);
        items.erase(std::find(items.begin(), items.end(), std::make_pair(place, message)));
        return helds_.number(flat(items));
    }

    std::vector<std::pair<int, int>> pairs(int held) const {
        std::vector<std::pair<int, int>> items;
        const Ints &flat = helds_.at(held);
        for (size_t each = 0; each < flat.size(); each += 2) items.emplace_back(flat[each], flat[each + 1]);
        return items;
    }

    static Ints flat(const std::vector<std::pair<int, int>> &items) {
        Ints values;
        for (const auto &[place, message] : items) values.insert(values.end(), {place, message});
        return values;
    }

    void put(int32_t *state, int kind, int from, int to, int message) {
        const int place = places_[kind][1 + from][1 + to];
        if (state[closed_] >> place & 1) return;
        int32_t &channel = state[first_channel_ + place];
        channel = queues_.pushed(channel, message);
    }

    void apply(int32_t *state, int who, int input) {
        const Reaction &reaction = react(state[who], input);
        if (reaction.broken) throw Broken();
        state[who] = reaction.next;
        const int self = who - 1;
        for (const auto &[event, one, two] : reaction.events) switch (event) {
            case PUT_STATUS:
                for (int each = 0; each < count_; each++)
                    if (state[1 + each] >= 0) put(state, STATUS, -1, each, one);
                break;
            case PUT_STATE:
                if (state[1 + one] >= 0) put(state, STATE, -1, one, two);
                break;
            case PUT_COMMAND: put(state, COMMAND, self, -1, stamped(state, self, one)); break;
            case PUT_READY: put(state, READY, self, -1, stamped(state, self, one)); break;
            case PUT_ANNOUNCEMENT:
                for (int each = 0; each < count_; each++)
                    if (each != self && state[1 + each] >= 0) put(state, ANNOUNCEMENT, self, each, stamped(state, self, one));
                break;
            case ACTED:
                if (one <= state[acted_ + self] || !viewed(state[0], two, self)) throw Broken();
                state[acted_ + self] = one;
                break;
            case REPORTS_READ:
                for (int message : queues_.at(state[first_channel_])) report_read(state, asked(STAMPED, -1, message, 0, 0));
                state[first_channel_] = 0;
                break;
            case OTHER: break;
        }
        if (reaction.ends) end(state, self);
    }

    // A message with the identifier of its writer, by the number of its content.
    int stamped(const int32_t *state, int sender, int content) {
        const uint64_t key = both_of(content, 16 * state[started_ + sender] + sender);
        if (const int *known = stamped_.find(key)) return *known;
        return stamped_.add(key, asked(STAMPED, sender, state[started_ + sender], content, 0));
    }

    // Whether a satellite acts by a formation that the plant has had.
    bool viewed(int plant_number, int view, int satellite_index) {
        const uint64_t key = both_of(plant_number, 8 * view + satellite_index);
        if (const int *known = views_.find(key)) return *known;
        return views_.add(key, asked(VIEW, plant_number, view, satellite_index, 0));
    }

    void end(int32_t *state, int satellite_index) {
        if (doomed(state, satellite_index)) {
            state[fate_] = (state[fate_] & ~(1 << satellite_index)) | killed_bit(satellite_index, state[started_ + satellite_index]);
            for (int place = 0; place < channels_; place++)
                if (from_[place] == satellite_index) state[closed_] &= ~(1 << place);
        }
        state[1 + satellite_index] = -1 - satellite(state[1 + satellite_index]).disk;
        for (int place = 0; place < channels_; place++)
            if (receiver(place) == 1 + satellite_index) state[first_channel_ + place] = 0;
        state[first_channel_] = queues_.pushed(state[first_channel_], asked(STAMPED, -2, satellite_index, 0, 0));
        std::vector<std::pair<int, int>> kept;
        for (const auto &item : pairs(state[held_]))
            if (receiver(item.first) != 1 + satellite_index) kept.push_back(item);
        state[held_] = helds_.number(flat(kept));
    }

    void time_out(int32_t *state) {
        int unresponsive = 0;
        for (int each = 0; each < count_; each++)
            if (state[1 + each] < 0 || !satellite(state[1 + each]).flying) unresponsive |= 1 << each;
        const int before = plant(state[0]).alive;
        apply(state, 0, asked(INPUT, GIVEN_TIMEOUT, unresponsive, 0, 0));
        if (before & ~unresponsive & ~plant(state[0]).alive) throw Broken();
    }

    void restart(int32_t *state, int index) {
        state[1 + index] = asked(NEW_PROCESS, index, -1 - state[1 + index], 0, 0);
        const Ints statuses = plant(state[0]).statuses;
        for (int status : statuses) put(state, STATUS, -1, index, status);
        state[started_ + index]++;
        apply(state, 1 + index, asked(INPUT, GIVEN_BEGIN, 0, 0, 0));
    }

    static constexpr uint32_t ENDED = UINT32_MAX;

    int count_, channels_, faults_, restarts_;
    int reduction_;
    Ask ask_;
    int first_channel_, held_, budget_, waiting_, started_, acted_, closed_, fate_, width_;
    Ints answer_, kinds_, from_, to_;
    std::array<std::array<std::array<int, 9>, 9>, 6> places_{};
    Sequences queues_, helds_;
    std::deque<PlantFacts> plants_;
    std::deque<SatelliteFacts> satellites_;
    std::deque<Reaction> reactions_;
    Numbers reaction_numbers_, inputs_, views_, stamped_;
    std::unordered_map<Ints, int, Hash> asked_;
    std::array<Numbers, 256> commuting_;
    std::vector<Action> found_;
    std::vector<uint64_t> prints_, levels_;
    std::vector<uint32_t> table_, parents_, calm_;
    std::vector<uint16_t> by_;
    std::vector<int> ended_;
    uint64_t limit_ = 0, transitions_ = 0, ends_ = 0, by_now_ = 0, frontier_ = 0, length_ = 0;
};

extern "C" {

Search *search_new(int count, int channels, const int32_t *table, int faults, int restarts, int reduction, Ask ask) {
    return new Search(count, channels, table, faults, restarts, reduction, ask);
}
void search_delete(Search *search) { delete search; }
int search_width(const Search *search) { return search->width(); }
int search_sequence(Search *search, const int32_t *values, int length) { return search->sequence(values, length); }
int search_explore(Search *search, const int32_t *first, uint64_t limit, uint64_t *figures) { return search->explore(first, limit, figures); }
int search_history(Search *search, uint64_t number, int32_t *actions) { return search->history(number, actions); }
int search_walk(Search *search, const int32_t *first, uint64_t seed, int walks, int disturbed, uint64_t *figures, int32_t *actions) {
    return search->walk(first, seed, walks, disturbed, figures, actions);
}
int search_ended(const Search *search, int32_t *plants) {
    if (plants) std::copy(search->ended().begin(), search->ended().end(), plants);
    return static_cast<int>(search->ended().size());
}
}
