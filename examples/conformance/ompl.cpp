// Planners of the Open Motion Planning Library 1.5 for `cgla conform`, with the cost of a problem as their objective.
//
//     sh build_ompl.sh
//     cgla conform -- ./ompl BiTRRT --seconds 10
//
// It reads a problem as JSON from standard input and writes a path as JSON to standard output. What any planner needs is
// in problem.hpp, of which dijkstra.cpp makes a planner without a library. Docs: docs/conformance.md.

#include <cstring>
#include <ctime>
#include <functional>
#include <limits>
#include <memory>

#include <ompl/base/MotionValidator.h>
#include <ompl/base/OptimizationObjective.h>
#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/goals/GoalState.h>
#include <ompl/base/objectives/MechanicalWorkOptimizationObjective.h>
#include <ompl/base/samplers/informed/PathLengthDirectInfSampler.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/planners/informedtrees/ABITstar.h>
#include <ompl/geometric/planners/informedtrees/AITstar.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/rrt/BiTRRT.h>
#include <ompl/geometric/planners/rrt/LBTRRT.h>
#include <ompl/geometric/planners/rrt/RRTsharp.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>
#include <ompl/geometric/planners/rrt/TRRT.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include "problem.hpp"

namespace ob = ompl::base;
namespace og = ompl::geometric;

// Bounds of costs stay below costs by a rounding, or BIT* prunes the path that it has.
const double BELOW = 1.0 - 1e-12;

Point at(const ob::State* state) {
    const double* values = state->as<ob::RealVectorStateSpace::StateType>()->values;
    return {values[0], values[1]};
}

// ---- the problem, as OMPL asks for it ----

// LBTRRT knows no objective: what it keeps small is the distance of its space, which is the cost then.
struct Space : ob::RealVectorStateSpace {
    const Map& map;
    bool by_cost;
    Space(const Map& map, bool by_cost) : ob::RealVectorStateSpace(2), map(map), by_cost(by_cost) {}
    double distance(const ob::State* a, const ob::State* b) const override {
        return by_cost ? map.cost(at(a), at(b)) : ob::RealVectorStateSpace::distance(a, b);
    }
};

struct Motions : ob::MotionValidator {
    const Map& map;
    Motions(const ob::SpaceInformationPtr& si, const Map& map) : ob::MotionValidator(si), map(map) {}
    bool checkMotion(const ob::State* a, const ob::State* b) const override { return !map.crosses(at(a), at(b)); }
    bool checkMotion(const ob::State* a, const ob::State* b, std::pair<ob::State*, double>& last) const override {
        last.second = 0.0;
        return checkMotion(a, b);
    }
};

// length + k * risk. No motion costs less than its length, so what is drawn for shorter paths is drawn for cheaper ones.
struct Cost : ob::OptimizationObjective {
    const Map& map;
    Cost(const ob::SpaceInformationPtr& si, const Map& map) : ob::OptimizationObjective(si), map(map) {
        setCostToGoHeuristic([&map](const ob::State* s, const ob::Goal*) { return ob::Cost(length(at(s), map.goal)); });
    }
    static double length(Point a, Point b) { return BELOW * std::hypot(b.x - a.x, b.y - a.y); }
    ob::Cost stateCost(const ob::State* s) const override { return ob::Cost(1.0 + map.k * map.risk(at(s))); }
    ob::Cost motionCost(const ob::State* a, const ob::State* b) const override { return ob::Cost(map.cost(at(a), at(b))); }
    ob::Cost motionCostHeuristic(const ob::State* a, const ob::State* b) const override { return ob::Cost(length(at(a), at(b))); }
    ob::InformedSamplerPtr allocInformedStateSampler(const ob::ProblemDefinitionPtr& definition, unsigned int calls) const override {
        return std::make_shared<ob::PathLengthDirectInfSampler>(definition, calls);
    }
};

// What TRRT and BiTRRT were made for, and their default: how much the cost of a state rises on the way, and a little of
// the length. (With the cost itself as their objective they find no path on many maps.)
struct Work : ob::MechanicalWorkOptimizationObjective {
    const Map& map;
    Work(const ob::SpaceInformationPtr& si, const Map& map) : ob::MechanicalWorkOptimizationObjective(si), map(map) {}
    ob::Cost stateCost(const ob::State* s) const override { return ob::Cost(1.0 + map.k * map.risk(at(s))); }
};

// The goal, drawn a little beside itself: LBTRRT aborts when it has a state twice, as of edges without a length.
struct Beside : ob::GoalState {
    mutable ompl::RNG random;
    const Map& map;
    Beside(const ob::SpaceInformationPtr& si, const Map& map) : ob::GoalState(si), map(map) { setThreshold(reach()); }
    double reach() const { return 1e-7 * map.side; }
    double distanceGoal(const ob::State* s) const override { return std::hypot(at(s).x - map.goal.x, at(s).y - map.goal.y); }
    void sampleGoal(ob::State* s) const override {
        double* values = s->as<ob::RealVectorStateSpace::StateType>()->values;
        values[0] = map.goal.x + reach() * random.uniformReal(-0.7, 0.7);
        values[1] = map.goal.y + reach() * random.uniformReal(-0.7, 0.7);
    }
    unsigned int maxSampleCount() const override { return std::numeric_limits<unsigned int>::max(); }
};

// ---- options, and the best path so far ----

struct Options {
    std::string planner;
    double seconds = 10.0, until = 0.0;
    unsigned int seed = 1;
    bool history = false;
    std::map<std::string, std::string> settings;
};

struct Found {
    Path path;
    double cost = HUGE_VAL;
    std::vector<std::pair<double, Path>> history;
};

double cpu() { return double(std::clock()) / CLOCKS_PER_SEC; }

double cost_of(const Map& map, const Path& path) {
    double sum = 0.0;
    for (size_t i = 0; i + 1 < path.size(); ++i) {
        if (map.crosses(path[i], path[i + 1])) return HUGE_VAL;
        sum += map.cost(path[i], path[i + 1]);
    }
    return path.size() < 2 ? HUGE_VAL : sum;
}

bool same(Point a, Point b) { return a.x == b.x && a.y == b.y; }

struct Run {
    const Map& map;
    const Options& options;
    const double began = cpu();
    Found found;

    double elapsed() const { return cpu() - began; }
    bool is_over() const { return elapsed() >= options.seconds || found.cost <= options.until; }

    // some planners hand over their path from the goal to the start, and without its ends
    void keep(Path path) {
        for (int turn = 0; turn < 2; ++turn) {
            Path whole = path;
            for (Point& point : whole)
                if (std::hypot(point.x - map.goal.x, point.y - map.goal.y) < 2e-7 * map.side) point = map.goal;
            if (whole.empty() || !same(whole.front(), map.start)) whole.insert(whole.begin(), map.start);
            if (!same(whole.back(), map.goal)) whole.push_back(map.goal);
            const double cost = cost_of(map, whole);
            if (cost < found.cost) {
                found.path = whole;
                found.cost = cost;
                if (options.history) found.history.push_back({elapsed(), whole});
            }
            std::reverse(path.begin(), path.end());
        }
    }
    void keep(const std::vector<ob::State*>& states) {
        Path path;
        for (const ob::State* state : states) path.push_back(at(state));
        keep(path);
    }
};

// ---- the planners ----

// LBTRRT hands over its path at its end alone, and does not go on when it is called again: its tree is looked at meanwhile.
struct LowerBoundTree : og::LBTRRT {
    using og::LBTRRT::LBTRRT;
    std::vector<Motion*> ends;
    size_t seen = 0;
    double best = HUGE_VAL;
    void report(Run& run) {
        for (; seen < idToMotionMap_.size(); ++seen)
            if (pdef_->getGoal()->isSatisfied(idToMotionMap_[seen]->state_)) ends.push_back(idToMotionMap_[seen]);
        for (Motion* end : ends) {
            if (end->costApx_ >= best) continue;
            best = end->costApx_;
            Path path;
            for (Motion* motion = end; motion; motion = motion->parentApx_) path.push_back(at(motion->state_));
            run.keep(path);
        }
    }
};

ob::PlannerPtr planner_named(const std::string& name, const ob::SpaceInformationPtr& si) {
    if (name == "TRRT") return std::make_shared<og::TRRT>(si);
    if (name == "BiTRRT") return std::make_shared<og::BiTRRT>(si);
    if (name == "LBTRRT") return std::make_shared<LowerBoundTree>(si);
    if (name == "RRTsharp") return std::make_shared<og::RRTsharp>(si);
    if (name == "RRTstar") return std::make_shared<og::RRTstar>(si);
    if (name == "BITstar") return std::make_shared<og::BITstar>(si);
    if (name == "ABITstar") return std::make_shared<og::ABITstar>(si);
    if (name == "AITstar") return std::make_shared<og::AITstar>(si);
    throw std::runtime_error(name + ": no such planner; there are TRRT, BiTRRT, LBTRRT, RRTsharp, RRTstar, BITstar, ABITstar, AITstar");
}

// Ends with its first path: run again and again, each path shortened by its cost, as AnytimePathShortening does.
bool ends_early(const std::string& name) { return name == "TRRT" || name == "BiTRRT"; }

void shorten(og::PathGeometric& path, og::PathSimplifier& simplifier, const Run& run) {
    // until a round gains less than a thousandth
    for (double before = HUGE_VAL; !run.is_over();) {
        simplifier.shortcutPath(path, 100, 100);
        simplifier.perturbPath(path, 0.05 * run.map.side, 100, 100);
        Path points;
        for (const ob::State* state : path.getStates()) points.push_back(at(state));
        const double cost = cost_of(run.map, points);
        if (cost > 0.999 * before) return;
        before = cost;
    }
}

Found plan(const Map& map, const Options& options) {
    Run run{map, options};
    auto space = std::make_shared<Space>(map, options.planner == "LBTRRT");
    ob::RealVectorBounds bounds(2);
    bounds.setLow(0, map.x_min), bounds.setHigh(0, map.x_max), bounds.setLow(1, map.y_min), bounds.setHigh(1, map.y_max);
    space->setBounds(bounds);
    auto si = std::make_shared<ob::SpaceInformation>(space);
    si->setStateValidityChecker([&map](const ob::State* state) { return !map.is_closed(at(state)); });
    si->setMotionValidator(std::make_shared<Motions>(si, map));
    si->setup();
    auto definition = std::make_shared<ob::ProblemDefinition>(si);
    ob::ScopedState<ob::RealVectorStateSpace> start(space), goal(space);
    start[0] = map.start.x, start[1] = map.start.y, goal[0] = map.goal.x, goal[1] = map.goal.y;
    definition->setStartAndGoalStates(start, goal);
    if (options.planner == "LBTRRT") {
        auto beside = std::make_shared<Beside>(si, map);
        beside->setState(goal);
        definition->setGoal(beside);
    }
    auto cost = std::make_shared<Cost>(si, map);
    if (ends_early(options.planner))
        definition->setOptimizationObjective(std::make_shared<Work>(si, map));
    else
        definition->setOptimizationObjective(cost);
    definition->setIntermediateSolutionCallback([&run](const ob::Planner*, const std::vector<const ob::State*>& states, const ob::Cost) {
        Path path;
        for (const ob::State* state : states) path.push_back(at(state));
        run.keep(path);
    });
    ob::PlannerPtr planner = planner_named(options.planner, si);
    if (!planner->params().setParams(options.settings, false)) throw std::runtime_error("a setting is unknown");
    planner->setProblemDefinition(definition);
    planner->setup();
    og::PathSimplifier simplifier(si, definition->getGoal(), cost);
    auto* tree = dynamic_cast<LowerBoundTree*>(planner.get());
    // in slices that grow by a fifth: not all planners hand over what they have meanwhile
    for (double slice = 0.01; !run.is_over(); slice *= 1.2) {
        const double end = tree || ends_early(options.planner) ? options.seconds : slice;
        const ob::PlannerStatus status = planner->solve(ob::PlannerTerminationCondition([&] {
            if (tree) tree->report(run);
            return run.is_over() || run.elapsed() >= end;
        }));
        if (status == ob::PlannerStatus::INVALID_START || status == ob::PlannerStatus::INVALID_GOAL) break;
        if (definition->hasExactSolution()) {
            auto& path = *definition->getSolutionPath()->as<og::PathGeometric>();
            run.keep(path.getStates());
            if (ends_early(options.planner)) {
                shorten(path, simplifier, run);
                run.keep(path.getStates());
            }
        }
        if (ends_early(options.planner)) {
            definition->clearSolutionPaths();
            planner->clear();
        }
    }
    return run.found;
}

Options options_of(int count, char** words) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string word = words[i];
        const size_t equals = word.find('=');
        auto next = [&] {
            if (++i == count) throw std::runtime_error(word + " lacks its value");
            return std::string(words[i]);
        };
        if (word == "--seconds") options.seconds = std::stod(next());
        else if (word == "--until") options.until = std::stod(next());
        else if (word == "--seed") options.seed = std::stoul(next());
        else if (word == "--history") options.history = true;
        else if (equals != std::string::npos) options.settings[word.substr(0, equals)] = word.substr(equals + 1);
        else options.planner = word;
    }
    if (options.planner.empty()) throw std::runtime_error("which planner? ompl NAME [--seconds S] [SETTING=VALUE …]");
    return options;
}

int main(int count, char** words) {
    try {
        const Options options = options_of(count, words);
        ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
        ompl::RNG::setSeed(options.seed);
        const Found found = plan(read_problem(), options);
        std::fputs("{\"path\": ", stdout);
        print_path(found.path);
        if (!found.path.empty()) std::printf(", \"cost\": %.17g", found.cost);
        if (options.history) {
            std::fputs(", \"history\": [", stdout);
            for (size_t i = 0; i < found.history.size(); ++i) {
                std::printf("%s{\"seconds\": %.6f, \"path\": ", i ? ", " : "", found.history[i].first);
                print_path(found.history[i].second);
                std::fputs("}", stdout);
            }
            std::fputs("]", stdout);
        }
        std::puts("}");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
