// The client agent of the thesis, reconstructed: it decides, the robot obeys.
//
// For Jason, and for interpreters that run failure plans (-!goal) as Jason does. One action, tcp_write(Request), sends
// Request to `nxtdrive serve`; the answer then stands as the percept received(N). See docs/agentspeak.md.

targets([lena, rilakkuma]).
max_researches(2).      // searches for one target after the first
angle(90).              // degrees to the right
waiting(15000).         // milliseconds

!start.

+!start <-
    .print("Connecting to NXT");
    tcp_write(connect);
    ?received(C);
    +connectable(C);
    ?targets(Targets);
    !pursue(Targets).

+!pursue([]) <-
    tcp_write(bye).
+!pursue([X | Others]) <-
    -researches(_);
    +researches(0);
    !arrive_at(X);
    !change_target(X, Others);
    !pursue(Others).

+!arrive_at(X) : connectable(1) <-
    .print("Arriving at ", X);
    tcp_write(arrive(X));
    ?received(N);
    !arriving(N, X).

// Not arrived: see what can be done, and search again. Too often: enough of it.
-!arrive_at(X) : researches(R) & max_researches(Max) & R < Max <-
    !select;
    -researches(_);
    +researches(R + 1);
    !arrive_at(X).
-!arrive_at(X) <-
    +given_up(X).

+!arriving(0, X) <-
    .print("Continue...");
    !arrive_at(X).
+!arriving(1, _).
+!arriving(_, _) <-
    .print("Failed");
    .fail.

+!change_target(X, [_ | _]) : given_up(X) <-
    .print("change target!").
+!change_target(_, _).

// The target was not recognised: look from elsewhere. It was, but could not be reached: wait.
+!select <-
    tcp_write(select);
    ?received(Exist);
    !recover(Exist).

+!recover(0) <-
    ?angle(A);
    !move_to(A).
+!recover(1) <-
    !wait.

+!wait <-
    ?waiting(T);
    .wait(T).

// 0: not done yet, also when the safety stop has cut this advance short. 1: done, or it cannot go on.
+!move_to(A) <-
    tcp_write(move_to(A));
    ?received(N);
    !moving(N, A).

+!moving(1, _).
+!moving(0, A) <-
    !move_to(A).
