// Substitute for the part of DUECA's interface that the example uses, written from its documentation: the test
// compiles the module with it, and passes samples to the module. It is not DUECA.
#ifndef DUECA_STUB_H
#define DUECA_STUB_H

#include <cstddef>
#include <iostream>
#include <stdexcept>
#include <string>

#define USING_DUECA_NS
#define CHECK_TOKEN(token) (res = res && (token).isValid())

static const char *const set_timing_description = "";

struct Entity {};
struct PrioritySpec {};
struct GlobalId {};

struct TimeSpec {
    double dt, at;
    int getValiditySpan() const { return dt > 0 ? 1 : 0; }
    double getDtInSeconds() const { return dt; }
};
inline std::ostream &operator<<(std::ostream &out, const TimeSpec &ts) { return out << ts.at; }

struct Probe {};
template <class M, class T> struct MemberCall : Probe {
    explicit MemberCall(bool (M::*)(const T &)) {}
};
template <class M, class T> struct VarProbe : Probe {
    explicit VarProbe(T M::*) {}
};
struct ParameterTable {
    const char *name;
    Probe *probe;
    const char *description;
};

struct NameSet {
    NameSet(const char *, const char *, const char *) {}
};
struct Channel {
    enum Kind { Continuous, Events };
};
template <class T> const char *getclassname() { return T::name(); }

struct Token {
    void *data = nullptr;
    bool isValid() const { return data != nullptr; }
};
struct ChannelReadToken : Token {
    ChannelReadToken(const GlobalId &, const NameSet &, const char *, int, Channel::Kind);
};
struct ChannelWriteToken : Token {
    ChannelWriteToken(const GlobalId &, const NameSet &, const char *, const char *, Channel::Kind);
};
template <class T> struct DataReader {
    ChannelReadToken &token;
    DataReader(ChannelReadToken &token, const TimeSpec &) : token(token) {
        if (!token.isValid()) throw std::runtime_error("no data");
    }
    const T &data() const { return *static_cast<T *>(token.data); }
};
template <class T> struct DataWriter {
    ChannelWriteToken &token;
    DataWriter(ChannelWriteToken &token, const TimeSpec &) : token(token) {}
    T &data() { return *static_cast<T *>(token.data); }
};

struct CallbackBase {};
template <class M> struct Callback : CallbackBase {
    Callback(M *, void (M::*)(const TimeSpec &)) {}
};
struct ActivityCallback {
    bool on = false;
    ActivityCallback(const GlobalId &, const char *, CallbackBase *, const PrioritySpec &) {}
    void setTrigger(ChannelReadToken &) {}
    void setTimeSpec(const TimeSpec &) {}
    void switchOn(const TimeSpec &) { on = true; }
    void switchOff(const TimeSpec &) { on = false; }
};

struct Module {
    Module(Entity *, const char *, const char *) {}
    virtual ~Module() {}
    virtual bool complete() = 0;
    virtual bool isPrepared() = 0;
    virtual void startModule(const TimeSpec &) = 0;
    virtual void stopModule(const TimeSpec &) = 0;
    GlobalId getId() const { return GlobalId(); }
    const char *getEntity() const { return "entity"; }
};
template <class M> struct TypeCreator {
    explicit TypeCreator(const ParameterTable *) {}
};

#endif
