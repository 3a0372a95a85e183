// The recursive prediction error method of Scilab, for ARMAX models, its only structure. Called as
// `scilab-cli -nb -f scilab_rpem.sce -args RECORD.csv RUNS`; prints the line of JSON that _peer.py describes.
function measure()
  arguments = sciargs();
  at = find(arguments == "-args");
  record = csvRead(arguments(at + 1));
  runs = strtod(arguments(at + 2));
  // B begins at lag 1; the rest of the delay is taken out of the data.
  e = record(1:$-28, 1)';
  u = record(29:$, 2)';
  n = 2;
  // theta, P, l, phi and psi at the start: coefficients of A, B and C, and what the filters remember.
  start = list([-1.9, 0.92, 0.04, -0.04, 0, 0], 0.1 * eye(3 * n, 3 * n), zeros(1, 3 * n), zeros(1, 3 * n), zeros(1, 3 * n));
  lambda = 1 - 1 / 256;
  times = zeros(1, runs);
  for k = 1:runs
    tic();
    // The forgetting factor goes on as lambda(t) = 1 lambda(t-1) + 0.
    model = rpem(start, e, u, [lambda, 1, 0]);
    times(k) = toc();
    if sum(times) > 4 then
      times = times(1:k);
      break
    end
  end
  numbers = getversion("scilab");
  version = msprintf("%d.%d.%d", numbers(1:3));
  answer = strcat(msprintf("%.15g\n", model(1)'), ", ");
  mprintf("{""task"": ""rpem"", ""peer"": ""scilab %s"", ""seconds"": %.9g, ""answer"": [%s], ""differs"": ""ARMAX, its only structure, without history""}\n", ..
          version, median(times), answer);
endfunction
try
  measure();
catch
  mprintf("{""task"": ""rpem"", ""peer"": ""scilab"", ""skipped"": ""%s""}\n", strsubst(lasterror(), """", "''"));
end
exit
